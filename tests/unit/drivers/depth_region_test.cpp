// SPDX-License-Identifier: Apache-2.0
// Depth frames through shared memory: the writer and the reader, and memory that is none.
#include "drivers/depth_region/depth_region.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

namespace hapticd::drivers {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kWidth = 37;  // rows whose bytes are no multiple of a word
constexpr std::uint32_t kHeight = 5;
constexpr std::size_t kImageBytes = std::size_t{kWidth} * 2 * kHeight;

rt::DepthFrameHeader headerOfFrame(std::uint64_t number) {
  rt::DepthFrameHeader header;
  header.width_px = kWidth;
  header.height_px = kHeight;
  header.stride_bytes = kWidth * 2;
  header.frame = number;
  return header;
}

/// Every byte is that of the frame's number.
std::vector<std::byte> imageOfFrame(std::uint64_t number, std::size_t bytes = kImageBytes) {
  return std::vector<std::byte>(bytes, static_cast<std::byte>(number & 0xffU));
}

void publish(DepthRegionWriter& writer, std::uint64_t number) {
  writer.publish(headerOfFrame(number), imageOfFrame(number));
}

std::unique_ptr<DepthRegionWriter> makeWriter() {
  auto writer = DepthRegionWriter::create(kImageBytes);
  EXPECT_TRUE(writer.has_value()) << writer.error().text();
  return std::move(*writer);
}

base::Descriptor copyOf(const DepthRegionWriter& writer) {
  return base::Descriptor(::fcntl(writer.descriptor(), F_DUPFD_CLOEXEC, 0));
}

DepthRegionReader openReader(const DepthRegionWriter& writer) {
  auto reader = DepthRegionReader::open(copyOf(writer));
  EXPECT_TRUE(reader.has_value()) << reader.error().text();
  return std::move(*reader);
}

TEST(DepthRegion, GivesTheNewestFrameWholeAndNothingBeforeTheFirst) {
  const auto writer = makeWriter();
  const DepthRegionReader reader = openReader(*writer);
  rt::DepthFrameHeader header;
  std::vector<std::byte> image;
  EXPECT_FALSE(reader.read(header, image));
  for (std::uint64_t number = 1; number < 4 * DepthRegionWriter::kSlots; ++number) {
    const std::uint32_t before = reader.changes();
    publish(*writer, number);
    EXPECT_NE(before, reader.changes());
    ASSERT_TRUE(reader.read(header, image));
    EXPECT_EQ(number, header.frame);
    EXPECT_EQ(imageOfFrame(number), image);
  }
}

TEST(DepthRegion, NeverGivesAFrameMixedOfTwo) {
  const auto writer = makeWriter();
  const DepthRegionReader reader = openReader(*writer);
  constexpr std::uint64_t kFrames = 20'000;
  std::thread publisher([&writer] {
    for (std::uint64_t number = 1; number <= kFrames; ++number) publish(*writer, number);
  });
  rt::DepthFrameHeader header;
  std::vector<std::byte> image;
  std::uint64_t newest = 0;
  while (newest < kFrames) {
    if (!reader.read(header, image)) continue;
    EXPECT_GE(header.frame, newest);
    newest = header.frame;
    EXPECT_EQ(imageOfFrame(newest), image);
    if (HasFailure()) break;
  }
  publisher.join();
}

TEST(DepthRegion, WakesWhoWaitsForAFrameAndForItsEnd) {
  auto writer = makeWriter();
  const DepthRegionReader reader = openReader(*writer);
  EXPECT_FALSE(reader.wait(reader.changes(), 1ms));
  std::atomic<int> woken = 0;
  std::thread waiting([&reader, &woken] {
    std::uint32_t seen = 0;
    while (!reader.closed()) {
      if (!reader.wait(seen, 1h)) break;
      seen = reader.changes();
      ++woken;
      woken.notify_one();
    }
  });
  publish(*writer, 1);
  woken.wait(0);
  EXPECT_FALSE(reader.closed());
  writer.reset();
  waiting.join();
  EXPECT_TRUE(reader.closed());
  rt::DepthFrameHeader header;
  std::vector<std::byte> image;
  EXPECT_TRUE(reader.read(header, image)) << "the newest frame stays readable";
}

TEST(DepthRegion, IgnoresAFrameThatIsTooLarge) {
  const auto writer = makeWriter();
  const DepthRegionReader reader = openReader(*writer);
  publish(*writer, 1);
  rt::DepthFrameHeader larger = headerOfFrame(2);
  larger.height_px = 10'000 / larger.stride_bytes;
  writer->publish(larger, imageOfFrame(2, 10'000));
  rt::DepthFrameHeader header;
  std::vector<std::byte> image;
  ASSERT_TRUE(reader.read(header, image));
  EXPECT_EQ(1U, header.frame);
}

TEST(DepthRegion, CannotBeChangedByWhomItIsHandedTo) {
  const auto writer = makeWriter();
  const base::Descriptor memory = copyOf(*writer);
  EXPECT_EQ(MAP_FAILED, ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, memory.get(), 0));
  EXPECT_EQ(-1, ::pwrite(memory.get(), "x", 1, 0));
  EXPECT_EQ(EPERM, errno);
  EXPECT_EQ(-1, ::ftruncate(memory.get(), 0));
  EXPECT_EQ(-1, ::ftruncate(memory.get(), 1 << 30));
  EXPECT_EQ(-1, ::fcntl(memory.get(), F_ADD_SEALS, F_SEAL_WRITE));
}

/// A memory file with the first bytes `head`, sealed as `seals` says.
base::Descriptor memoryWith(const void* head, std::size_t bytes, std::size_t size, int seals) {
  base::Descriptor memory(::memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  EXPECT_EQ(0, ::ftruncate(memory.get(), static_cast<off_t>(size)));
  EXPECT_EQ(static_cast<ssize_t>(bytes), ::pwrite(memory.get(), head, bytes, 0));
  EXPECT_EQ(0, ::fcntl(memory.get(), F_ADD_SEALS, seals));
  return memory;
}

class DepthRegionRefusal : public testing::Test {
 protected:
  DepthRegionRefusal() {
    head_.slots = 2;
    head_.first_slot = 4096;
    head_.slot_bytes = 8192;
    head_.image_offset = 320;
  }
  std::string fault(std::size_t size = 4096 + 2 * 8192, int seals = F_SEAL_SHRINK) const {
    const base::Descriptor memory = memoryWith(&head_, std::min(sizeof(head_), size), size, seals);
    const auto reader = DepthRegionReader::open(memory);
    return reader ? "" : reader.error().text();
  }
  static bool names(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  }

  DepthRegionHead head_;
};

TEST_F(DepthRegionRefusal, DoesNotConcernAWholeOne) {
  EXPECT_EQ("", fault());
}

TEST_F(DepthRegionRefusal, DoesNotConcernSlotsThatBeginOrEndWithinAPage) {
  EXPECT_EQ("", fault(4096 + 2 * 8192 + 100));
  head_.first_slot = 64;
  head_.slot_bytes = 1032;
  EXPECT_EQ("", fault(64 + 2 * 1032)) << "pages may have 4, 16 or 64 KiB";
}

TEST_F(DepthRegionRefusal, NamesWhatIsWrong) {
  EXPECT_TRUE(names(fault(8), "too short"));
  EXPECT_TRUE(names(fault(4096 + 2 * 8192, F_SEAL_GROW), "not sealed"));
  head_.magic[0] = 'X';
  EXPECT_TRUE(names(fault(), "does not begin as one"));
  head_.magic = DepthRegionHead::kMagic;
  head_.version = 2;
  EXPECT_TRUE(names(fault(), "version 2"));
}

TEST_F(DepthRegionRefusal, FindsEverySizeThatWouldLeadOutOfTheMemory) {
  const DepthRegionHead whole;
  const auto refused = [this](auto change) {
    const auto [slots, first, bytes, offset] =
        std::tuple(head_.slots, head_.first_slot, head_.slot_bytes, head_.image_offset);
    change();
    EXPECT_TRUE(names(fault(), "sizes"));
    head_.slots = slots;
    head_.first_slot = first;
    head_.slot_bytes = bytes;
    head_.image_offset = offset;
  };
  for (const std::uint32_t slots : {0U, 3U, 0xffffffffU}) refused([&] { head_.slots = slots; });
  for (const std::uint64_t first : {8192UL, 1UL << 40, ~0UL, 4100UL})
    refused([&] { head_.first_slot = first; });
  for (const std::uint64_t bytes : {0UL, 16384UL, ~0UL, 1UL << 63})
    refused([&] { head_.slot_bytes = bytes; });
  for (const std::uint64_t offset : {0UL, 264UL, 8200UL, ~0UL, 321UL})
    refused([&] { head_.image_offset = offset; });
}

}  // namespace
}  // namespace hapticd::drivers
