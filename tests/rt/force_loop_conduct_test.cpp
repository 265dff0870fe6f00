// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/loop/force_loop.h"
#include "rt/tracking/solid_tracker.h"
#include "tests/rt/loop_rig.h"
#include "tests/rt/watch/watch.h"
#include "tests/support/rerun.h"
#include "tests/unit/rt/fixtures/made_grid.h"

namespace hapticd::test {
namespace {

// Verifies that the force thread does not allocate, lock, fault pages or throw while it runs. Everything
// inside run() is monitored while all inputs change; planted violations show that the monitor detects each
// kind.

/// Runs the loop of `rig` for `ticks` ticks in a thread that is monitored inside run() and during the
/// `planted` violation just before it.
template <typename Deed>
WatchedSection::Seen watchedRun(LoopRig& rig, std::size_t ticks, Deed planted) {
  WatchedSection::Seen seen;
  std::jthread force_thread([&] {
    rig.loop.prepare();
    WatchedSection section;
    planted();
    rig.loop.run();
    seen = section.end();
  });
  EXPECT_TRUE(exercise(rig, ticks));
  rig.loop.requestStop();
  force_thread.join();
  return seen;
}

WatchedSection::Seen watchedRun(LoopRig& rig) {
  constexpr std::size_t kTicks = 300;
  return watchedRun(rig, kTicks, [] {});
}

template <typename Deed>
WatchedSection::Seen watchedRunWith(Deed planted) {
  constexpr std::size_t kTicks = 10;
  LoopRig rig;
  return watchedRun(rig, kTicks, planted);
}

TEST(ForceThread, AllocatesLocksAndThrowsNothing) {
  LoopRig rig;
  EXPECT_EQ(watchedRun(rig).misconduct, Misconduct{});
  if (*kSight.said_instead != '\0') reportNotChecked(kSight.said_instead);
}

TEST(ForceThread, IsCaughtAllocating) {
  if (!kSight.allocations) return reportNotChecked(kSight.said_instead);
  std::vector<int> numbers;
  EXPECT_EQ(watchedRunWith([&numbers] { numbers.push_back(1); }).misconduct, Misconduct{.allocations = 1});
}

TEST(ForceThread, IsCaughtLocking) {
  if (!kSight.locks) return reportNotChecked(kSight.said_instead);
  std::mutex mutex;
  EXPECT_EQ(watchedRunWith([&mutex] { const std::lock_guard lock(mutex); }).misconduct,
            Misconduct{.locks = 1});
}

TEST(ForceThread, IsCaughtThrowing) {
  if (!kSight.exceptions) return reportNotChecked(kSight.said_instead);
  const auto throwing = [] {
    try {
      throw std::runtime_error("planted");
    } catch (const std::runtime_error&) {
    }
  };
  EXPECT_EQ(watchedRunWith(throwing).misconduct.exceptions, 1U);
}

TEST(ForceThread, FaultsNoPage) {
  const LockedMemory memory;
  LoopRig rig;
  const PageFaults faults = watchedRun(rig).page_faults;
  const std::string found =
      std::to_string(faults.minor) + " minor and " + std::to_string(faults.major) + " major page faults";
  if (!memory.locked()) {
    return reportNotChecked(
        "that there is no page fault: memory cannot be locked here (RLIMIT_MEMLOCK, or a "
        "sanitizer that does not); without that there were " +
        found);
  }
  EXPECT_EQ(faults.minor, 0) << found;
  EXPECT_EQ(faults.major, 0) << found;
}

TEST(ForceThread, IsCaughtFaultingAPage) {
  const LockedMemory memory;
  UntouchedPage page;
  EXPECT_GE(watchedRunWith([&page] { page.touch(); }).page_faults.minor, 1);
  if (!memory.locked()) reportNotChecked("that this is the only page fault: memory cannot be locked here");
}

// What a thread does while it tracks a solid: it must neither allocate nor lock.

TEST(TrackingConduct, NeitherAllocatesNorLocksInAStep) {
  const MadeGrid made([](const rt::Vec3& p) { return norm(p) - 0.04; }, 0.045, 0.002);
  rt::SolidTracker tracker(made.grid);
  const rt::DepthModel model({}, {});
  const auto frame = std::make_unique<rt::DepthFrame>();
  // A sphere of which the camera sees a disc is near enough: points are fitted, rays are traced.
  std::ranges::fill(frame->image(), static_cast<std::uint16_t>(std::lround(model.rawOf(0.57))));
  rt::TrackingRequest request;
  request.predicted.position_m = {0, 0, -0.6};
  request.last = request.predicted;
  request.mask = rt::SightMask{{0, 0.02, -0.5}, {0, 0.02, -0.6}, 0.01};
  WatchedSection section;
  const rt::Tracking found = tracker.step(model, frame->image(), request, {});
  request.predicted.position_m = {0, 0, -3};
  tracker.step(model, frame->image(), request, {});
  const Misconduct seen = section.end().misconduct;
  EXPECT_EQ(seen, Misconduct{});
  EXPECT_GT(found.iterations, 0);
}

}  // namespace
}  // namespace hapticd::test
