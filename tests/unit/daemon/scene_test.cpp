// SPDX-License-Identifier: Apache-2.0
// The scene thread, and frames that the depth camera finds by a solid.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "daemon/scene/scene_thread.h"
#include "tests/support/flush_to_zero.h"
#include "tests/support/program.h"
#include "tests/unit/rt/tracking/tracked_scene.h"

namespace hapticd::daemon {
namespace {

/// A scene thread that models each frame around a HIP in front of the camera.
class ScenesOfFrames : public testing::Test {
 protected:
  ScenesOfFrames() {
    focus_.back() = {0, 0, -1};
    focus_.publish();
    thread_.start();
  }

  /// The record of the frame's scene.
  trace::ModelRecord model(std::uint64_t frame, std::int64_t arrival_ns) {
    rt::DepthFrame& raw = thread_.back();
    std::fill(raw.image().begin(), raw.image().end(), std::uint16_t{760});
    raw.sequence = frame;
    raw.arrival_ns = arrival_ns;
    raw.device_ticks = 0;
    thread_.publish();
    trace::ModelRecord record;
    EXPECT_TRUE(test::becomesTrue([&] { return thread_.models().pop(record) && record.frame == frame; }));
    return record;
  }

  rt::SceneChannel scenes_;
  rt::TripleBuffer<rt::Vec3> focus_;
  SceneThread thread_{{}, {}, {}, {}, scenes_, focus_};
};

TEST_F(ScenesOfFrames, BeginAnewWithTheFirstRecordedFrameAndWithTheFirstOneAfterAGap) {
  constexpr std::int64_t kPeriod_ns = SceneThread::kMinRestartInterval_ns / 5;
  const std::set<std::uint64_t> refused{2, 3, 9, 12, 20};
  EXPECT_FALSE(model(1, 0).forgot) << "without a recording it goes on";
  thread_.setTap([&refused](const rt::DepthFrame& frame) { return !refused.contains(frame.sequence); });
  std::vector<std::uint64_t> restarts;
  for (std::uint64_t frame = 2; frame <= 25; ++frame) {
    const trace::ModelRecord record = model(frame, static_cast<std::int64_t>(frame) * kPeriod_ns);
    EXPECT_EQ(record.depth_recorded, !refused.contains(frame)) << frame;
    if (record.forgot) restarts.push_back(frame);
  }
  // 12 follows 9 too soon: the force is not disturbed more often than every five of these frames
  EXPECT_EQ(restarts, (std::vector<std::uint64_t>{4, 10, 15, 21}));
}

TEST_F(ScenesOfFrames, GoOnAsTheyAreWithoutARecording) {
  for (std::uint64_t frame = 1; frame <= 3; ++frame) {
    const trace::ModelRecord record = model(frame, static_cast<std::int64_t>(frame));
    EXPECT_FALSE(record.forgot);
    EXPECT_FALSE(record.depth_recorded);
  }
}

TEST(SceneThreadOfAFlushingProcess, KeepsSubnormalNumbers) {
  rt::SceneChannel scenes;
  rt::TripleBuffer<rt::Vec3> focus;
  std::atomic<int> kept{-1};
  std::jthread([&] {
    test::flushSubnormalsToZero();
    SceneThread thread{{}, {}, {}, {}, scenes, focus};
    thread.setTap([&kept](const rt::DepthFrame&) {
      kept = test::keepsSubnormals() ? 1 : 0;
      return true;
    });
    thread.start();
    thread.publish();
    EXPECT_TRUE(test::becomesTrue([&kept] { return kept != -1; }));
    thread.stop();
  }).join();
  EXPECT_EQ(kept, 1);
}

// Frames that the depth camera finds by a solid, from rendered frames with the noise of a Kinect.

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
