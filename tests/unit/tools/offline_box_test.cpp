// SPDX-License-Identifier: Apache-2.0
// The age of a frame in the ticks of an OfflineBox.

#include "tools/lib/offline/offline_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "rt/laws/force_law.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr rt::Vec3 kAnyPlace{0, 0, -1};

class OfflineBoxTime : public testing::Test {
 protected:
  OfflineBoxTime() : box({}, {}, {}), frame(std::make_unique<rt::DepthFrame>()) {
    frame->sequence = 1;
    frame->arrival_ns = 100 * kMillisecond_ns;
    std::ranges::fill(frame->image(), drivers::kKinectNoMeasurement);
  }
  OfflineBox box;
  std::unique_ptr<rt::DepthFrame> frame;
};

TEST_F(OfflineBoxTime, HasNoAgeWhereNobodySaysWhenAFrameArrived) {
  box.show(*frame);
  for (int i = 0; i < 2'000; ++i) {
    const rt::Tick tick = box.tick(kAnyPlace);
    ASSERT_EQ(tick.scene_age_ns, 0) << i;
    ASSERT_EQ(tick.mode, rt::Mode::engaged) << i;
  }
}

TEST_F(OfflineBoxTime, CountsFromTheArrivalWhereTheTimeIsSet) {
  box.show(*frame, 102 * kMillisecond_ns);
  EXPECT_EQ(box.tick(kAnyPlace).scene_age_ns, 2 * kMillisecond_ns)
      << "the next tick is at the time that was set";
  EXPECT_EQ(box.tick(kAnyPlace).scene_age_ns, 3 * kMillisecond_ns) << "the others follow by their periods";
  EXPECT_EQ(box.tick(kAnyPlace, 0.01).scene_age_ns, 13 * kMillisecond_ns);
  box.setTime(140 * kMillisecond_ns);
  EXPECT_EQ(box.tick(kAnyPlace).scene_age_ns, 40 * kMillisecond_ns);
}

TEST_F(OfflineBoxTime, TakesAFrameThatIsShownForLongForStale) {
  box.show(*frame, 101 * kMillisecond_ns);
  rt::Tick tick;
  for (int i = 0; i < 500; ++i)
    tick = box.tick(kAnyPlace);  // the last one at 600 ms, 500 ms after the arrival
  EXPECT_EQ(tick.mode, rt::Mode::engaged);
  tick = box.tick(kAnyPlace);
  EXPECT_EQ(tick.mode, rt::Mode::holding);
  EXPECT_EQ(tick.cause, rt::Cause::depth_stale);
}

TEST_F(OfflineBoxTime, HasNoAgeAgainAfterAFrameWithoutTime) {
  box.show(*frame, 150 * kMillisecond_ns);
  EXPECT_EQ(box.tick(kAnyPlace).scene_age_ns, 50 * kMillisecond_ns);
  box.show(*frame);
  EXPECT_EQ(box.tick(kAnyPlace).scene_age_ns, 0);
}

TEST(FrameAge, IsThatOfTheFrameAndTheCamerasLatencyTogether) {
  rt::Scene scene;
  scene.frame = 1;
  scene.frame_time_ns = 1'000 * kMillisecond_ns;
  constexpr double kRounding_s = 1e-12;
  EXPECT_NEAR(rt::frameAge_s(scene, 1'020 * kMillisecond_ns, 0), 0.02, kRounding_s);
  constexpr double kLatency_s = 0.06;
  EXPECT_NEAR(rt::frameAge_s(scene, 1'020 * kMillisecond_ns, kLatency_s), 0.08, kRounding_s);
  EXPECT_EQ(rt::frameAge_s(scene, 1'041 * kMillisecond_ns, kLatency_s), rt::kMaxPrediction_s);
  EXPECT_EQ(rt::frameAge_s(scene, 900 * kMillisecond_ns, kLatency_s), 0) << "a frame from the future";
  scene.frame = 0;
  EXPECT_EQ(rt::frameAge_s(scene, 1'020 * kMillisecond_ns, kLatency_s), 0) << "no frame";
}

}  // namespace
}  // namespace hapticd::tools
