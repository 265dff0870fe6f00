// SPDX-License-Identifier: Apache-2.0
#include "rt/tracking/solid_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/unit/rt/tracking/tracked_scene.h"

namespace hapticd::test {
namespace {

using rt::SolidPose;
using rt::Tracking;
using rt::TrackingVerdict;
using rt::Vec3;
using tools::PlacedSolid;
using tools::SolidKind;

constexpr double kDegree = std::numbers::pi / 180;

TEST(SolidTracker, FindsAnOrganFromNearbyPredictions) {
  TrackedScene scene(SolidKind::organ, 1);
  for (int trial = 0; trial < 4; ++trial) {
    scene.place(0.6);
    scene.show();
    for (int start = 0; start < 3; ++start) {
      scene.predict(0.005, 4 * kDegree);
      const Tracking found = scene.track();
      EXPECT_EQ(found.verdict, TrackingVerdict::tracked) << wordOf(found.verdict);
      // What the tracker says of its error; four times, because there are few frames.
      EXPECT_LT(scene.error_m(found), 4 * found.noise_error_m);
      EXPECT_LT(scene.error_m(found), 0.001);
      EXPECT_EQ(found.frozen, 0U);
    }
  }
}

TEST(SolidTracker, FindsAnOrganFromFarAwayOrRefusesIt) {
  TrackedScene scene(SolidKind::organ, 2);
  int tracked = 0;
  constexpr int kStarts = 30;
  for (int start = 0; start < kStarts; ++start) {
    if (start % 10 == 0) {
      scene.place(0.6);
      scene.show();
    }
    scene.predict(0.02, 15 * kDegree);
    const Tracking found = scene.track();
    if (found.verdict != TrackingVerdict::tracked) continue;
    ++tracked;
    EXPECT_LT(scene.error_m(found), 0.001);
  }
  // Of such starts about one in twelve does not lead to the solid; to have more than a third of 30 of these
  // is less likely than 1e-4.
  EXPECT_GE(tracked, 2 * kStarts / 3);
}

TEST(SolidTracker, FindsTheSamePoseFromEveryPrediction) {
  TrackedScene scene(SolidKind::organ, 3);
  scene.place(0.6);
  scene.show();
  const Tracking first = scene.track();
  for (int start = 0; start < 5; ++start) {
    scene.predict(0.005, 4 * kDegree);
    const Tracking found = scene.track();
    // The lattice of pixels differs with the prediction, and with it the sample of the noise.
    EXPECT_LT(scene.error_m(found), scene.error_m(first) + 3 * first.noise_error_m);
  }
}

TEST(SolidTracker, RefusesWhatTheShapeDoesNotShow) {
  struct Weak {
    SolidKind kind;
    std::size_t frozen;
    bool turns;
  };
  // A sphere turns about all axes, a cylinder about its own and slides along it; a plate slides in two
  // directions and turns about its normal.
  for (const Weak& weak : {Weak{SolidKind::sphere, 3, true}, Weak{SolidKind::cylinder, 2, false},
                           Weak{SolidKind::plate, 3, false}}) {
    TrackedScene scene(weak.kind, 4);
    scene.place(0.6);
    scene.show();
    for (int start = 0; start < 5; ++start) {
      scene.predict(0.004, 4 * kDegree);
      const Tracking found = scene.track();
      EXPECT_EQ(found.verdict, TrackingVerdict::weak_geometry)
          << nameOf(weak.kind) << " " << wordOf(found.verdict);
      EXPECT_EQ(found.frozen, weak.frozen) << nameOf(weak.kind);
      if (weak.turns) {
        EXPECT_TRUE(found.weakestIsRotation());
        const Vec3& turn = found.weakest.rotation_rad;
        EXPECT_LT(norm(cross(turn, found.weakestAxisPlace_m())), 0.005 * norm(turn));  // through the middle
      }
      // It is not the residual that shows it.
      EXPECT_LT(found.rms_m, scene.limits.max_residual_sigmas * found.expected_rms_m) << nameOf(weak.kind);
      EXPECT_GT(found.share, scene.limits.min_share) << nameOf(weak.kind);
    }
  }
}

TEST(SolidTracker, DoesNotDriftWhereTheShapeShowsNothing) {
  TrackedScene scene(SolidKind::sphere, 5);
  scene.place(0.6);
  scene.predict(0, 5 * kDegree);
  const SolidPose first = scene.request.predicted;
  for (int frame = 0; frame < 20; ++frame) {
    scene.show();
    const Tracking found = scene.track();
    scene.request.predicted = found.pose;
    // The shift is known to about 0.1 mm, and the pose that moves the surface least turns with it by as much
    // over the radius of 50 mm; five times that, and no more after many frames.
    EXPECT_LT(angleBetween_rad(found.pose, first), 0.01) << frame;
    EXPECT_LT(norm(found.pose.position_m - scene.truth.position_m), 0.001);
  }
  // For the middle of a sphere the same fit is good enough.
  scene.request.target_m_in_solid = {};
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::tracked);
}

TEST(SolidTracker, AcceptsWeakGeometryWhereThePredictionIsKnown) {
  TrackedScene scene(SolidKind::cylinder, 6);
  scene.place(0.6);
  scene.show();
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::weak_geometry);
  scene.limits.unseen_shift_m = 0.0005;
  scene.limits.unseen_rotation_rad = 0.5 * kDegree;
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::tracked);
}

TEST(SolidTracker, RefusesTheNoiseWhereItIsTooLarge) {
  TrackedScene scene(SolidKind::organ, 7);
  scene.place(0.6);
  scene.show();
  ASSERT_EQ(scene.track().verdict, TrackingVerdict::tracked);
  scene.limits.max_target_error_m = 0.0002;
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::target_error);
}

TEST(SolidTracker, NoticesThatASymmetricBodyIsTheOtherWayRoundByTheJumpAlone) {
  TrackedScene scene(SolidKind::ellipsoid, 8);
  // As if weak directions did not matter, so that nothing else refuses it.
  scene.limits.min_condition = 0;
  scene.limits.max_target_error_m = 0.1;
  scene.place(0.6);
  scene.show();
  const SolidPose turned = rt::movedInSolid(scene.truth, {}, {0, 0, std::numbers::pi}, {});
  scene.request.predicted = turned;
  const Tracking found = scene.track();
  EXPECT_EQ(found.verdict, TrackingVerdict::jumped);
  EXPECT_GT(found.jump_rad, 150 * kDegree);
  EXPECT_LT(found.rms_m, found.expected_rms_m);
  EXPECT_GT(found.share, 0.9);
  // Without a last pose nothing tells it apart.
  scene.request.last.reset();
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::tracked);
}

TEST(SolidTracker, AllowsLargerJumpsAfterLostFrames) {
  TrackedScene scene(SolidKind::organ, 9);
  scene.place(0.6);
  scene.show();
  scene.request.last = rt::movedInSolid(scene.truth, {}, {}, {0, 0.025, 0});
  scene.request.frames_since_last = 2;
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::jumped);
  scene.request.frames_since_last = 3;
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::tracked);
  scene.request.last = rt::movedInSolid(scene.truth, {}, {}, {0, 0.035, 0});
  scene.request.frames_since_last = std::numeric_limits<int>::max();  // limited by max_jump_frames
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::jumped);
}

/// Counts of results that may be used, and of those that are wrong.
struct Tally {
  int tracked = 0;
  int wrong = 0;
  void add(const TrackedScene& scene, const Tracking& found) {
    if (found.verdict != TrackingVerdict::tracked) return;
    ++tracked;
    if (scene.error_m(found) > scene.limits.max_target_error_m) ++wrong;
  }
};

TEST(SolidTracker, AcceptsNoWrongPoseFrom200BadStarts) {
  for (const SolidKind kind : {SolidKind::organ, SolidKind::ellipsoid, SolidKind::corner}) {
    TrackedScene scene(kind, 10);
    Tally tally;
    for (int start = 0; start < 200; ++start) {
      if (start % 25 == 0) {
        scene.place(start % 50 == 0 ? 0.6 : 1.0);
        scene.show();
      }
      // An organ has no symmetry, so the points alone must do.
      if (kind == SolidKind::organ) scene.request.last.reset();
      const double worse = 1 + start % 4;
      scene.predict(0.03 * worse, 25 * kDegree * worse);
      tally.add(scene, scene.track());
    }
    EXPECT_EQ(tally.wrong, 0) << nameOf(kind);
  }
}

TEST(SolidTracker, AcceptsNothingInPlaceOfTheSolid) {
  TrackedScene scene(SolidKind::organ, 11);
  for (const double distance_m : {0.6, 1.0}) {
    scene.place(distance_m);
    scene.request.last.reset();
    std::vector<std::vector<PlacedSolid>> others{{}};
    for (const SolidKind kind : tools::kAllSolids) {
      if (kind == SolidKind::organ) continue;
      others.push_back({{kind, scene.truth}});
      others.push_back({{kind, rt::movedInSolid(scene.truth, {}, {}, {0, 0, 0.03})}});
    }
    for (const auto& solids : others) {
      scene.showOnly(solids);
      for (int start = 0; start < 6; ++start) {
        scene.predict(0.004 * start, 4 * kDegree * start);
        const Tracking found = scene.track();
        EXPECT_NE(found.verdict, TrackingVerdict::tracked)
            << distance_m << " " << (solids.empty() ? "nothing" : nameOf(solids[0].kind)) << " rms "
            << found.rms_m << " of " << found.expected_rms_m << " uneven " << found.unevenness << " share "
            << found.share;
      }
    }
  }
}

TEST(SolidTracker, AcceptsNoWrongPoseBehindWhatHidesTheSolid) {
  TrackedScene scene(SolidKind::organ, 12);
  Tally tally;
  for (int trial = 0; trial < 16; ++trial) {
    scene.place(0.6);
    // A rod or a plate 20 to 80 mm before the solid, anywhere over it: hides up to all of it.
    PlacedSolid before{trial % 2 == 0 ? SolidKind::cylinder : SolidKind::plate, scene.truth};
    before.T_world_solid = rt::movedInSolid(before.T_world_solid, {}, {0, 0, scene.uniform()}, {});
    before.T_world_solid.position_m +=
        Vec3{0.07 * scene.uniform(), 0.06 * scene.uniform(), 0.07 + 0.03 * scene.uniform()};
    scene.show({before});
    for (int start = 0; start < 6; ++start) {
      scene.predict(0.004 * start, 4 * kDegree * start);
      tally.add(scene, scene.track());
    }
  }
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.tracked, 10);  // where enough of it is left
}

TEST(SolidTracker, CountsWhatIsBeforeTheSolidAsHiddenAndNotAsMisfit) {
  TrackedScene scene(SolidKind::organ, 13);
  scene.place(0.6);
  scene.show();
  const Tracking open = scene.track();
  SolidPose before = scene.truth;
  before.position_m += Vec3{0, 0.035, 0.06};
  scene.show({{SolidKind::cylinder, before}});
  const Tracking behind = scene.track();
  EXPECT_EQ(behind.verdict, TrackingVerdict::tracked) << wordOf(behind.verdict);
  EXPECT_LT(behind.visible_share, open.visible_share - 0.1);
  EXPECT_GT(behind.share, scene.limits.min_share);
  // The same rod, masked as the user's tool, is hidden too, however near to the surface it is.
  scene.request.mask = rt::SightMask{before.placeOut({-0.06, 0, 0}), before.placeOut({0.06, 0, 0}), 0.035};
  EXPECT_EQ(scene.track().verdict, TrackingVerdict::tracked);
}

TEST(SolidTracker, NoticesThatTheBodyIsGone) {
  TrackedScene scene(SolidKind::organ, 14);
  scene.place(0.6);
  scene.show();
  ASSERT_EQ(scene.track().verdict, TrackingVerdict::tracked);
  scene.showOnly({});
  EXPECT_NE(scene.track().verdict, TrackingVerdict::tracked);
}

TEST(SolidTracker, HasNoPoseWithoutAnUsableRequestOrImage) {
  TrackedScene scene(SolidKind::organ, 15);
  scene.place(0.6);
  scene.show();
  const auto expectNone = [&] {
    const Tracking found = scene.track();
    EXPECT_EQ(found.verdict, TrackingVerdict::too_few_points);
    EXPECT_EQ(found.used, 0U);
  };
  const rt::TrackingRequest good = scene.request;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  scene.request.predicted.position_m.x = kNan;
  expectNone();
  scene.request = good;
  scene.request.predicted.rotation[4] = 2;
  expectNone();
  scene.request = good;
  scene.request.last->rotation[0] = kNan;
  expectNone();
  scene.request = good;
  scene.request.target_m_in_solid.z = kNan;
  expectNone();
  scene.request = good;
  scene.request.predicted.position_m = {0, 0, 1};  // behind the camera
  expectNone();
  scene.request.predicted.position_m = {1e300, 0, -1};
  expectNone();
  scene.request = good;
  const Tracking no_image = scene.tracker.step(scene.model, {}, scene.request, scene.limits);
  EXPECT_EQ(no_image.verdict, TrackingVerdict::too_few_points);
  std::ranges::fill(scene.frame().image(), scene.model.parameters().raw_no_measurement);
  expectNone();

  rt::SolidTracker empty(rt::DistanceGrid{});
  EXPECT_FALSE(empty.hasSolid());
  scene.show();
  EXPECT_EQ(empty.step(scene.model, scene.frame().image(), scene.request, scene.limits).verdict,
            TrackingVerdict::too_few_points);
}

TEST(SolidTracker, SurvivesAnyImageAndAnyPrediction) {
  TrackedScene scene(SolidKind::organ, 16);
  scene.place(0.6);
  scene.request.last.reset();
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    for (std::uint16_t& raw : scene.frame().image()) raw = static_cast<std::uint16_t>(random());
    scene.predict(0.02 * trial, 0.2 * trial);
    EXPECT_NE(scene.track().verdict, TrackingVerdict::tracked);
  }
}

TEST(PixelLattice, CoversTheBallWithNoMorePixelsThanAllowed) {
  const rt::DepthModel model(tools::kinectWithNoise(), {});
  for (const double distance_m : {0.2, 0.4, 0.6, 1.0, 3.0}) {
    for (const int most : {1, 100, 1000, 4096}) {
      const rt::PixelLattice lattice = rt::latticeOver(model, {0, 0, -distance_m}, 0.08, most);
      EXPECT_LE(lattice.pixels(), most);
      EXPECT_GE(lattice.pixels(), std::min(most / 6, 100));
      EXPECT_LT(lattice.column_first + (lattice.columns - 1) * lattice.step_px, model.width_px());
      EXPECT_LT(lattice.row_first + (lattice.rows - 1) * lattice.step_px, model.height_px());
    }
  }
  EXPECT_EQ(rt::latticeOver(model, {0, 0, 1}, 0.08, 100).pixels(), 0);
}

}  // namespace
}  // namespace hapticd::test
