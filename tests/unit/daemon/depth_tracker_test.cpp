// SPDX-License-Identifier: Apache-2.0
// Frames that the depth camera finds by a solid, from rendered frames with the noise of a Kinect.
#include "daemon/scene/scene_thread.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <thread>
#include <vector>

#include "tests/unit/rt/tracking/tracked_scene.h"

namespace hapticd::daemon {
namespace {

using rt::TrackingVerdict;
using rt::Vec3;
using tools::SolidKind;

constexpr std::uint32_t kFrame = 7;

std::shared_ptr<const config::Solid> solidOf(SolidKind kind) {
  const tools::SolidGrid made(kind, 0.0015);
  const rt::DistanceGrid& grid = made.grid();
  return std::make_shared<const config::Solid>(grid, std::span(grid.coefficients, grid.size()),
                                               config::Solid::About{});
}

class DepthTrackerTest : public testing::Test {
 protected:
  DepthTrackerTest() {
    scene.place(0.6);
    start = scene.truth;
    tracker.setHip(start.placeOut(scene.request.target_m_in_solid) + Vec3{0, 0, 0.2});
  }
  void begin() { tracker.track({{kFrame, solidOf(SolidKind::organ), start}}); }

  /// Shows a frame and waits until `done`, at most a minute.
  bool show(const std::function<bool()>& done) {
    tracker.show(scene.frame());
    for (int i = 0; i < 12'000; ++i) {
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  /// The pose from one frame; nothing: none came.
  std::optional<rt::FramePose> poseOfFrame() {
    std::vector<rt::FramePose> poses;
    show([&] {
      for (const rt::FramePose& pose : tracker.takePoses()) poses.push_back(pose);
      return !poses.empty();
    });
    return poses.empty() ? std::nullopt : std::optional(poses.back());
  }
  bool becomes(const std::function<bool(const TrackingResult&)>& good) {
    return show([&] {
      const auto result = tracker.resultOf(kFrame);
      return result && good(*result);
    });
  }

  test::TrackedScene scene{SolidKind::organ, 3};
  rt::SolidPose start;
  DepthTracker tracker{{}};
};

TEST_F(DepthTrackerTest, FollowsASolidThatMoves) {
  EXPECT_FALSE(tracker.resultOf(kFrame));
  begin();
  ASSERT_TRUE(tracker.tracks());
  for (int i = 0; i < 8; ++i) {
    scene.truth = rt::movedInSolid(scene.truth, {}, {0, 0.004, 0.01}, {0.003, -0.002, 0.001});
    scene.show();
    scene.frame().exposure_ns = 1000 + i;
    const auto pose = poseOfFrame();
    ASSERT_TRUE(pose) << "frame " << i;
    EXPECT_EQ(pose->frame, kFrame);
    EXPECT_EQ(pose->time_ns, 1000 + i);
    // A place that is fixed to the frame, and so to the solid: at the start the frame is the world.
    const Vec3 target = scene.request.target_m_in_solid;
    const Vec3 found = placed(pose->T_world_frame, start.placeOut(target));
    EXPECT_LT(norm(found - scene.truth.placeOut(target)), 0.0015) << "frame " << i;
    EXPECT_NEAR(dot(pose->T_world_frame.orientation, pose->T_world_frame.orientation), 1, 1e-9);
    const auto result = tracker.resultOf(kFrame);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->verdict, TrackingVerdict::tracked);
    EXPECT_LT(result->error_m, 0.003);
  }
}

TEST_F(DepthTrackerTest, GivesNoPoseOfASolidThatIsNotThere) {
  begin();
  scene.show();
  ASSERT_TRUE(poseOfFrame());
  scene.showOnly({});
  EXPECT_TRUE(
      becomes([](const TrackingResult& result) { return result.verdict != TrackingVerdict::tracked; }));
  scene.showOnly({{SolidKind::sphere, scene.truth}});
  EXPECT_TRUE(
      becomes([](const TrackingResult& result) { return result.verdict != TrackingVerdict::tracked; }));
  EXPECT_TRUE(tracker.takePoses().empty());
  // It is found again where it was.
  scene.show();
  EXPECT_TRUE(poseOfFrame());
}

TEST_F(DepthTrackerTest, GoesOnFromWhereItWasWhenSomethingElseIsTrackedToo) {
  const auto organ = solidOf(SolidKind::organ);
  tracker.track({{kFrame, organ, start}});
  for (int i = 0; i < 6; ++i) {
    scene.truth = rt::movedInSolid(scene.truth, {}, {}, {0.006, 0, 0});
    scene.show();
    ASSERT_TRUE(poseOfFrame());
  }
  // From the start it would be too far.
  tracker.track({{kFrame, organ, start}, {kFrame + 1, organ, start}});
  scene.show();
  EXPECT_TRUE(
      becomes([](const TrackingResult& result) { return result.verdict == TrackingVerdict::tracked; }));
  tracker.track({});
  EXPECT_FALSE(tracker.tracks());
  EXPECT_FALSE(tracker.resultOf(kFrame));
}

}  // namespace
}  // namespace hapticd::daemon
