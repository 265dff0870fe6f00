// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/solids/solids.h"

// The numbers of `hapticbench solids`, by bodies whose distance is known in closed form.
namespace hapticd::tools {
namespace {

using rt::Vec3;

TEST(SolidsStudy, FindsTheExactDistanceOfABox) {
  const ExactSurface box(makeBody(BodyKind::box, 8));
  const ExactPlace outside = box.at({0.018, 0.019, 0});
  EXPECT_NEAR(outside.distance_m, 0.005, 1e-12);
  EXPECT_NEAR(outside.gradient.x, 0.6, 1e-9);
  EXPECT_NEAR(outside.gradient.y, 0.8, 1e-9);
  const ExactPlace inside = box.at({0.012, 0.001, 0.002});
  EXPECT_NEAR(inside.distance_m, -0.003, 1e-12);
  EXPECT_NEAR(inside.gradient.x, 1, 1e-9);
  EXPECT_TRUE(box.isNearEdge(outside.foot_m, 0.001));
  EXPECT_FALSE(box.isNearEdge(inside.foot_m, 0.001));
  EXPECT_TRUE(box.isAloneFor(inside, 0.001));
  EXPECT_FALSE(box.isAloneFor(box.at({0.0121, 0.0119, 0.002}), 0.002));
}

TEST(SolidsStudy, MakesClosedMeshesWithTheirFacesOutwards) {
  for (const BodyKind kind : kAllOf<BodyKind>) {
    Body body = makeBody(kind, 8);
    const solids::Topology topology = solids::repair(body.mesh);
    EXPECT_EQ(topology.boundary_edges + topology.crowded_edges + topology.reversed_edges, 0U) << nameOf(kind);
    const Vec3 inside = kind == BodyKind::torus ? Vec3{0.015, 0, 0} : Vec3{};
    EXPECT_LT(ExactSurface(body).at(inside).distance_m, 0) << nameOf(kind);
  }
}

TEST(SolidsStudy, CutsOffWhatABallThatCrossesCovers) {
  const DamagedBody crossed = damaged(makeBody(BodyKind::box, 8), Damage::crossing, 1);
  // The ball's centre is a point of the upper face: its dome and the circle where it meets the face are a
  // radius away, and the half of it within the box does not count. Its sagitta and the pieces into which
  // faces are cut are below 0.1 mm.
  const Vec3 centre_m{0.00375, 0.0075, 0.015};
  EXPECT_NEAR(ExactSurface(crossed.truth).at(centre_m).distance_m, -0.006, 1e-4);
}

TEST(SolidsStudy, MeasuresASphereWithinItsFacets) {
  const SolidOptions options{.divisions = 16, .places = 500, .pushes = 60};
  const SolidRow row = measureSolid({BodyKind::sphere, Damage::none, 0.0005}, options);
  ASSERT_TRUE(row.refusal.empty()) << row.refusal;
  EXPECT_EQ(row.wrong_signs, 0U);
  EXPECT_LE(row.surface_max_m, 0.0005);
  EXPECT_LE(row.rms_m, row.max_m);
  EXPECT_EQ(row.out.pushes + row.in.pushes + row.rest.pushes, 60U);
  // The direction of a smooth surface is off by up to about the angle between two facets.
  EXPECT_LE(row.gradient_p99_deg, 2 * row.fold_deg);
}

/// From 4 to 2 mm the rounding to 16 bits, 0.2 um RMS, is below the error of the spline.
TEST(SolidsStudy, ErrorOfTheSplineFallsWithTheThirdPowerOfTheSpacing) {
  const double coarse_m = sphereError(0.004, 5000).rms_m, fine_m = sphereError(0.002, 5000).rms_m;
  const double order = std::log2(coarse_m / fine_m);
  EXPECT_GT(order, 2.5);
  EXPECT_LT(order, 4.5);
}

}  // namespace
}  // namespace hapticd::tools
