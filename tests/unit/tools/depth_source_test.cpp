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

TEST(DepthSource, GivesAFrameFromItsArrivalUntilTheNextOneArrivesAndTheLastOneFromThenOn) {
  test::ScratchRecording recording;
  fillUnevenly(recording);
  const DepthSource source = opened(recording.path());
  for (const auto& [time_ns, frame] :
       std::initializer_list<std::pair<std::int64_t, std::size_t>>{{0, 0},
                                                                   {33'368'999, 0},
                                                                   {33'369'000, 1},
                                                                   {60'000'000, 1},
                                                                   {100'106'999, 1},
                                                                   {100'107'000, 2},
                                                                   {1'000'000'000'000'000'000, 2}}) {
    EXPECT_EQ(source.frameAt(time_ns), frame) << time_ns;
  }
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

}  // namespace
}  // namespace hapticd::tools
