// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/recording_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "tests/support/made_up_pixel.h"
#include "tests/support/program.h"
#include "tests/support/rerun.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kRealtimeOffset_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kFirst_ns = 12'000'000'007;

std::unique_ptr<rt::DepthFrame> madeUpFrame(std::uint32_t number) {
  auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t pixel = 0; pixel < kKinectPixels; ++pixel) {
    frame->raw[pixel] = test::madeUpPixel(number % 100, pixel);
  }
  frame->sequence = number + 1;
  frame->arrival_ns = kFirst_ns + std::int64_t{number} * 33'000'001;
  frame->device_ticks = 4'294'967'290U + number;  // wraps around
  return frame;
}

void add(RecordingWriter& writer, const rt::DepthFrame& frame) {
  const auto written = writer.write(frame);
  ASSERT_TRUE(written) << written.error().text();
}

void expectFrame(const RecordingReader& reader, std::uint32_t number) {
  const auto expected = madeUpFrame(number), read = std::make_unique<rt::DepthFrame>();
  const auto readable = reader.read(number, *read);
  ASSERT_TRUE(readable) << readable.error().text();
  EXPECT_TRUE(std::ranges::equal(read->image(), expected->image())) << number;
  EXPECT_EQ(read->device_ticks, expected->device_ticks);
  EXPECT_EQ(reader.frames()[number].realtime_ns, expected->arrival_ns + kRealtimeOffset_ns);
  EXPECT_EQ(reader.frames()[number].host_ns, expected->arrival_ns - kFirst_ns);
}

TEST(RecordingWriter, ReadsBackToThePixelAndNanosecond) {
  const test::TemporaryFolder folder;
  auto writer = RecordingWriter::create(folder.path() / "a.depth", kRealtimeOffset_ns);
  ASSERT_TRUE(writer) << writer.error().text();
  for (std::uint32_t number = 0; number < 20; ++number) add(**writer, *madeUpFrame(number));
  EXPECT_EQ((*writer)->frames(), 20U);
  const auto reader = RecordingReader::open(folder.path() / "a.depth");
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_EQ(reader->frames().size(), 20U);
  for (std::uint32_t number = 0; number < 20; ++number) expectFrame(*reader, number);
}

TEST(RecordingWriter, RefusesAFolderThatExistsOrCannotBeCreated) {
  const test::TemporaryFolder folder;
  folder.write("mine", "mine");
  EXPECT_FALSE(RecordingWriter::create(folder.path(), 0));
  EXPECT_FALSE(RecordingWriter::create(folder.path() / "mine", 0));
  EXPECT_FALSE(RecordingWriter::create(folder.path() / "nowhere" / "a.depth", 0));
}

/// Runs in a child: writes until it is killed.
void writeForever(const fs::path& folder) {
  auto writer = RecordingWriter::create(folder, kRealtimeOffset_ns);
  ASSERT_TRUE(writer);
  for (std::uint32_t number = 0;; ++number) add(**writer, *madeUpFrame(number));
}

TEST(RecordingWriter, IsReadableWheneverItIsKilled) {
  if (!test::rerunPart().empty()) return writeForever(test::rerunPart());
  for (const std::size_t lines : {1U, 5U, 9U}) {
    const test::TemporaryFolder folder;
    const fs::path recording = folder.path() / "a.depth";
    test::Program child({"/proc/self/exe", "--gtest_filter=RecordingWriter.IsReadableWheneverItIsKilled"},
                        {.environment = {std::string(test::kRerunVariable) + "=" + recording.string()}});
    const auto indexed = [&] {
      std::ifstream index(recording / "INDEX.txt");
      return static_cast<std::size_t>(std::count(std::istreambuf_iterator<char>(index), {}, '\n'));
    };
    ASSERT_TRUE(test::becomesTrue([&] { return indexed() >= lines; })) << child.output();
    child.signal(SIGKILL);
    child.wait();
    const auto reader = RecordingReader::open(recording);
    ASSERT_TRUE(reader) << reader.error().text();
    EXPECT_GE(reader->frames().size(), lines);
    for (std::uint32_t number = 0; number < reader->frames().size(); ++number) expectFrame(*reader, number);
  }
}

/// Runs in a child whose files may not become as large as an image.
void writeOnAFullDisk(const fs::path& folder) {
  std::signal(SIGXFSZ, SIG_IGN);
  auto writer = RecordingWriter::create(folder, kRealtimeOffset_ns);
  ASSERT_TRUE(writer);
  EXPECT_FALSE((*writer)->write(*madeUpFrame(0)));
  EXPECT_EQ((*writer)->frames(), 0U);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "no half image";
  EXPECT_EQ(fs::file_size(folder / "INDEX.txt"), 0U);
}

TEST(RecordingWriter, ReportsAFullDiskAndLeavesNoPartialImage) {
  if (!test::rerunPart().empty()) return writeOnAFullDisk(test::rerunPart());
  const test::TemporaryFolder folder;
  const auto child = test::runToEnd(
      {"/proc/self/exe", "--gtest_filter=RecordingWriter.ReportsAFullDiskAndLeavesNoPartialImage"},
      {.environment = {std::string(test::kRerunVariable) + "=" + (folder.path() / "a.depth").string()},
       .largest_file_bytes = 300'000});
  EXPECT_EQ(child.ending, test::exitedWith(0)) << child.output;
}

}  // namespace
}  // namespace hapticd::drivers
