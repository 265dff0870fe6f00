// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/depth_recorder.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>

#include "tests/support/made_up_pixel.h"
#include "tests/support/program.h"

namespace hapticd::daemon {
namespace {

std::unique_ptr<rt::DepthFrame> madeUpFrame(std::uint64_t number) {
  auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t pixel = 0; pixel < rt::kFramePixels; ++pixel) {
    frame->raw[pixel] = test::madeUpPixel(static_cast<std::uint32_t>(number), pixel);
  }
  frame->sequence = number;
  frame->arrival_ns = static_cast<std::int64_t>(number) * 33'000'000;
  return frame;
}

TEST(DepthRecorder, GivesEveryFrameInItsOrderWithTheCamerasHeader) {
  rt::DepthFrameHeader common;
  common.fx_px = 594;
  const auto recorder = DepthRecorder::start(common);
  ASSERT_TRUE(recorder) << recorder.error().text();
  drivers::DepthDecoder decoder;
  RecordedFrame recorded;
  const auto back = std::make_unique<rt::DepthFrame>();
  std::uint64_t taken = 0;
  const auto take = [&] {
    while ((*recorder)->take(recorded)) {
      ASSERT_EQ(decoder.decode(recorded.depth, *back), "");
      const auto expected = madeUpFrame(++taken);
      EXPECT_EQ(back->sequence, expected->sequence);
      EXPECT_EQ(std::memcmp(back->raw, expected->raw, sizeof back->raw), 0) << taken;
      EXPECT_EQ(recorded.depth.header.fx_px, 594);
      EXPECT_TRUE(recorded.cloud.points_m_in_camera.empty());
    }
  };
  for (std::uint64_t number = 1; number <= 20; ++number) {
    const auto frame = madeUpFrame(number);
    while (!(*recorder)->offer(*frame)) take();
    take();
  }
  (*recorder)->finish();
  take();
  EXPECT_EQ(taken, 20U);
}

TEST(DepthRecorder, RefusesAndCountsWhatASlowDiskHasNoRoomForAndLosesNothingThatItTook) {
  const auto recorder = DepthRecorder::start({});
  ASSERT_TRUE(recorder) << recorder.error().text();
  std::mt19937_64 random(1);
  const auto noise = std::make_unique<rt::DepthFrame>();  // it cannot be compressed
  for (std::uint16_t& raw : noise->raw) raw = static_cast<std::uint16_t>(random() % 65'536);
  std::uint64_t offered = 0;
  // nobody takes any: it must come to an end
  ASSERT_TRUE(test::becomesTrue([&] {
    if ((*recorder)->offer(*noise)) ++offered;
    return offered > DepthRecorder::kFrames && (*recorder)->lost() > 50;
  }));
  EXPECT_LE(offered * sizeof noise->raw,
            DepthRecorder::kMostWaitingBytes + (DepthRecorder::kFrames + 1) * sizeof noise->raw);
  (*recorder)->finish();
  std::uint64_t taken = 0;
  for (RecordedFrame recorded; (*recorder)->take(recorded);) ++taken;
  EXPECT_EQ(taken, offered);
}

}  // namespace
}  // namespace hapticd::daemon
