// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/depth_source.h"

#include <gtest/gtest.h>

#include <memory>

#include "drivers/camera/kinect_image.h"
#include "tests/support/scratch_recording.h"

namespace hapticd::tools {
namespace {

/// Three frames at 0, 33.369 and 100.107 ms.
void fillUnevenly(test::ScratchRecording& recording) {
  recording.add(1, "1500000000.500000", 1000);
  recording.add(2, "1500000000.533369", 2000);
  recording.add(3, "1500000000.600107", 3000);
  recording.writeIndex();
}

DepthSource opened(const std::filesystem::path& path) {
  auto source = DepthSource::open(path);
  if (!source) throw std::runtime_error(source.error().text());
  return std::move(*source);
}

bool holdsMadeUpFrame(const rt::DepthFrame& frame, std::uint32_t number) {
  for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
    if (frame.raw[pixel] != test::madeUpPixel(number, pixel)) return false;
  }
  return true;
}

TEST(DepthSource, GivesAFrameFromItsArrivalOn) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  EXPECT_EQ(source.frameAt(0), 0U);
  EXPECT_EQ(source.frameAt(33'369'000), 1U);
  EXPECT_EQ(source.frameAt(100'107'000), 2U);
}

TEST(DepthSource, KeepsAFrameUntilTheNextOneArrives) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  EXPECT_EQ(source.frameAt(33'368'999), 0U);
  EXPECT_EQ(source.frameAt(60'000'000), 1U);
  EXPECT_EQ(source.frameAt(100'106'999), 1U);
}

TEST(DepthSource, KeepsTheLastFrameAfterTheEnd) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  EXPECT_EQ(source.frameAt(1'000'000'000), 2U);
  EXPECT_EQ(source.frameAt(1'000'000'000'000'000'000), 2U);
}

TEST(DepthSource, GivesARecordedFrameItsArrivalSinceTheFirstOne) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  EXPECT_FALSE(source.isImage());
  const auto frame = std::make_unique<rt::DepthFrame>();
  ASSERT_TRUE(source.read(0, *frame));
  EXPECT_EQ(frame->arrival_ns, 0);
  ASSERT_TRUE(source.read(2, *frame));
  EXPECT_EQ(frame->arrival_ns, 100'107'000);
}

TEST(DepthSource, ReadsThePixelsOfTheFrameAskedFor) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (const std::size_t index : {std::size_t{2}, std::size_t{0}}) {
    ASSERT_TRUE(source.read(index, *frame));
    EXPECT_TRUE(holdsMadeUpFrame(*frame, static_cast<std::uint32_t>(index) + 1));
    EXPECT_NE(frame->sequence, 0U);  // 0 would mean: nothing modelled
  }
}

TEST(DepthSource, GivesASingleImageForAllTimes) {
  const test::TemporaryFolder folder;
  const DepthSource source = opened(folder.write("image.pgm", test::pgmBytes(7)));
  EXPECT_TRUE(source.isImage());
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (const std::int64_t time_ns : {std::int64_t{0}, std::int64_t{1'000'000'000'000'000'000}}) {
    EXPECT_EQ(source.frameAt(time_ns), 0U);
  }
  ASSERT_TRUE(source.read(0, *frame));
  EXPECT_TRUE(holdsMadeUpFrame(*frame, 7));
  EXPECT_NE(frame->sequence, 0U);
}

TEST(DepthSource, RefusesAPathWhereNothingIs) {
  const test::TemporaryFolder folder;
  const auto source = DepthSource::open(folder.path() / "none");
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().text(), (folder.path() / "none").string() +
                                       ": no such file or folder (--depth takes the folder of a recording or "
                                       "one .pgm file)");
}

TEST(DepthSource, RefusesAFolderThatIsNoRecording) {
  const test::TemporaryFolder folder;
  const auto source = DepthSource::open(folder.path());
  ASSERT_FALSE(source);
  EXPECT_NE(source.error().text().find("INDEX.txt"), std::string::npos) << source.error().text();
}

TEST(DepthSource, RefusesToReadASingleImageThatIsTruncated) {
  const test::TemporaryFolder folder;
  const DepthSource source = opened(folder.write("image.pgm", test::pgmBytes(7).substr(0, 1000)));
  const auto frame = std::make_unique<rt::DepthFrame>();
  const auto read = source.read(0, *frame);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().text().find("has 1000 bytes, expected 614417"), std::string::npos)
      << read.error().text();
}

}  // namespace
}  // namespace hapticd::tools
