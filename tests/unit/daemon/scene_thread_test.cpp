// SPDX-License-Identifier: Apache-2.0
#include "daemon/scene/scene_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <thread>
#include <vector>

#include "tests/support/flush_to_zero.h"
#include "tests/support/program.h"

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

}  // namespace
}  // namespace hapticd::daemon
