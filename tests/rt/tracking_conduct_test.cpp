// SPDX-License-Identifier: Apache-2.0
// What a thread does while it tracks a solid: it must neither allocate nor lock.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/tracking/solid_tracker.h"
#include "tests/rt/watch/watch.h"
#include "tests/unit/rt/fixtures/made_grid.h"

namespace hapticd::test {
namespace {

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
