// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/depth_recorder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <span>

#include "drivers/camera/kinect_image.h"
#include "tests/support/made_up_pixel.h"
#include "tests/support/program.h"

namespace hapticd::daemon {
namespace {

std::unique_ptr<rt::DepthFrame> madeUpFrame(std::uint64_t number) {
  auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
    frame->raw[pixel] = test::madeUpPixel(static_cast<std::uint32_t>(number), pixel);
  }
  frame->sequence = number;
  frame->arrival_ns = static_cast<std::int64_t>(number) * 33'000'000;
  return frame;
}

TEST(DepthRecorder, GivesEveryFrameInItsOrderWithTheCamerasHeader) {
  rt::DepthFrameHeader common;
  common.device_tick_hz = 594;
  const auto recorder = DepthRecorder::start(common);
  ASSERT_TRUE(recorder) << recorder.error().text();
  trace::DepthDecoder decoder;
  RecordedFrame recorded;
  const auto back = std::make_unique<rt::DepthFrame>();
  std::uint64_t taken = 0;
  const auto take = [&] {
    while ((*recorder)->take(recorded)) {
      ASSERT_EQ(decoder.decode(recorded.depth, *back), "");
      const auto expected = madeUpFrame(++taken);
      EXPECT_EQ(back->sequence, expected->sequence);
      EXPECT_EQ(std::memcmp(back->raw, expected->raw, back->image().size_bytes()), 0) << taken;
      EXPECT_EQ(recorded.depth.header.device_tick_hz, 594U);
      EXPECT_TRUE(recorded.cloud.points_m_in_optical.empty());
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
  for (std::uint16_t& raw : noise->image()) raw = static_cast<std::uint16_t>(random() % 65'536);
  std::uint64_t offered = 0;
  // nobody takes any: it must come to an end
  ASSERT_TRUE(test::becomesTrue([&] {
    if ((*recorder)->offer(*noise)) ++offered;
    return offered > DepthRecorder::kFrames && (*recorder)->lost() > 50;
  }));
  EXPECT_LE(offered * noise->image().size_bytes(),
            DepthRecorder::kMaxWaitingBytes + (DepthRecorder::kFrames + 1) * noise->image().size_bytes());
  (*recorder)->finish();
  std::uint64_t taken = 0;
  for (RecordedFrame recorded; (*recorder)->take(recorded);) ++taken;
  EXPECT_EQ(taken, offered);
}

TEST(DepthRecorder, GivesThePointsInTheNewestBallWithTheTimeOfTheirFrame) {
  rt::DepthFrameHeader common;
  common.depth_law_coefficients = {-0.003071102, 3.330949516};
  common.fx_px = common.fy_px = 594;
  common.cx_px = 320;
  common.cy_px = 240;
  common.rotation_world_camera = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const auto recorder = DepthRecorder::start(common, true);
  ASSERT_TRUE(recorder) << recorder.error().text();
  const trace::ros::ModelledBall ball{{0, 0, -1}, 0.3};
  auto frame = madeUpFrame(3);
  std::ranges::fill(frame->image(), std::uint16_t{760});  // 1.003 m
  const auto take = [&] {
    RecordedFrame recorded;
    EXPECT_TRUE(test::becomesTrue([&] { return (*recorder)->take(recorded); }));
    return recorded;
  };
  ASSERT_TRUE((*recorder)->offer(*frame));
  EXPECT_TRUE(take().cloud.points_m_in_optical.empty()) << "no ball is known yet";
  (*recorder)->setBall(ball);
  ASSERT_TRUE((*recorder)->offer(*frame));
  const RecordedFrame recorded = take();
  EXPECT_EQ(recorded.cloud.time_ns, frame->arrival_ns);
  trace::ros::DepthView view;
  const rt::DepthFrameHeader header = trace::headerOf(common, *frame);
  view.set(header, std::as_bytes(frame->image()));
  std::vector<float> expected;
  view.pointsInBall(ball, expected);
  EXPECT_GT(expected.size(), 3000U);
  EXPECT_EQ(recorded.cloud.points_m_in_optical, expected);
}

}  // namespace
}  // namespace hapticd::daemon
