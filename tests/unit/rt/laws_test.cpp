// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "rt/depth/depth_model.h"
#include "rt/laws/force_blend.h"
#include "rt/laws/force_laws.h"
#include "rt/laws/law_table.h"
#include "rt/laws/smooth_springs.h"
#include "tests/unit/rt/scene/made_up_scene.h"

namespace hapticd::test {
namespace {

using rt::ForceBlend;
using rt::Vec3;

constexpr std::uint16_t kRaw = 750;

/// A wall and the law above it.
class SmoothSpringsOnAWall {
 public:
  SmoothSpringsOnAWall() : scene_(model_, wholeFrameGrid()), laws_(scene_.builder.pointCapacity()) {
    scene_.build(*frameOf(kRaw));
    parameters.law = rt::ForceLaw::smooth_springs;
  }

  Vec3 force(const Vec3& beside_wall_m) {
    const Vec3 hip = beside_wall_m + Vec3{0, 0, -model_.depth_m(kRaw)};
    return laws_
        .force({.scene = scene_.scene,
                .hip_m_in_world = hip,
                .hip_velocity_m_per_s_in_world = {},
                .parameters = parameters,
                .stiffness_n_per_m = parameters.force.stiffness_n_per_m,
                .friction = parameters.contact.friction})
        .force_n_in_world;
  }

  rt::LiveParameters parameters;

 private:
  rt::DepthModel model_{rt::DepthModelParameters{}, rt::PoseParameters{}};
  BuiltScene scene_;
  rt::ForceLaws laws_;
};

TEST(SmoothSprings, MatchTheClosedFormAboveADensePlane) {
  SmoothSpringsOnAWall wall;
  // F = 2 k h (D - h) / (D + 2 h) for an infinitely dense plane
  for (const double h : {0.003, 0.005, 0.01, 0.01464, 0.02, 0.03}) {
    const double expected = 2 * 500 * h * (0.04 - h) / (0.04 + 2 * h);
    EXPECT_NEAR(wall.force({0.0003, 0.0007, h}).z, expected, 0.005 * expected + 1e-3) << h;
    EXPECT_NEAR(wall.force({0.0003, 0.0007, -h}).z, -expected, 0.005 * expected + 1e-3) << h;
  }
}

TEST(SmoothSprings, HaveTheirLargestForceWhereTheClosedFormHasIt) {
  SmoothSpringsOnAWall wall;
  // (2 - sqrt 3) k D at (sqrt 3 - 1) D / 2
  double largest = 0;
  double at = 0;
  for (double h = 0.005; h < 0.03; h += 1e-4) {
    const double force = wall.force({0, 0, h}).z;
    if (force > largest) {
      largest = force;
      at = h;
    }
  }
  EXPECT_NEAR(largest, (2 - std::sqrt(3.0)) * 500 * 0.04, 0.01);
  EXPECT_NEAR(at, (std::sqrt(3.0) - 1) * 0.04 / 2, 3e-4);
}

TEST(SmoothSprings, EnterTheRadiusWithForceZero) {
  SmoothSpringsOnAWall wall;
  double before = 0;
  for (double h = 0.041; h > 0.035; h -= 1e-6) {
    const double force = wall.force({0, 0, h}).z;
    EXPECT_LE(std::abs(force - before), 2 * 500 * 1e-6) << h;
    before = force;
  }
  EXPECT_GT(before, 0.5);
}

constexpr double kTick_s = 0.001;
constexpr double kStiffness = 500;

TEST(ForceBlend, PassesForcesAsLongAsNothingChanges) {
  ForceBlend blend;
  for (int i = 0; i < 10; ++i) {
    const Vec3 force{0.1 * i, 0, -i * 1.0};
    EXPECT_EQ(blend.apply(force, false, {}, kStiffness, kTick_s), force);
  }
}

TEST(ForceBlend, BlendsAChangeInEvenlyOverItsDuration) {
  ForceBlend blend;
  // 0.1 N per tick, of 0.25 N that the fastest surface may change
  const rt::BlendParameters parameters{.duration_s = 0.02};
  blend.apply({1, 0, 0}, false, parameters, kStiffness, kTick_s);
  for (int i = 1; i <= 20; ++i) {
    const Vec3 force = blend.apply({3, 0, 0}, i == 1, parameters, kStiffness, kTick_s);
    EXPECT_NEAR(force.x, 1 + 2 * i / 20.0, 1e-12) << i;
  }
  EXPECT_EQ(blend.apply({3, 0, 0}, false, parameters, kStiffness, kTick_s), (Vec3{3, 0, 0}));
}

TEST(ForceBlend, IsNeverFasterThanTheFastestSurface) {
  ForceBlend blend;
  const rt::BlendParameters parameters{.duration_s = 0.01};
  double before = 0;
  for (int i = 0; i < 60; ++i) {
    const double force = blend.apply({0, 0, 10}, i == 0, parameters, kStiffness, kTick_s).z;
    EXPECT_LE(force - before, kStiffness * 0.5 * kTick_s + 1e-12);
    before = force;
  }
  EXPECT_EQ(before, 10);
}

TEST(ForceBlend, AccountsForTheChangeOfTheLawsOwnForce) {
  // 0.5 m/s and 500 N/m allow 0.25 N per tick, of which the law's own force uses 0.1 N
  ForceBlend blend;
  const rt::BlendParameters parameters{.duration_s = 0.01};
  double before = blend.apply({0, 0, 10}, true, parameters, kStiffness, kTick_s).z;
  for (int i = 1; i < 20; ++i) {
    const double force = blend.apply({0, 0, 10 + 0.1 * i}, false, parameters, kStiffness, kTick_s, 0.1).z;
    EXPECT_NEAR(force - before, 0.25, 1e-12);
    before = force;
  }
  const double still = blend.apply({0, 0, 12}, false, parameters, kStiffness, kTick_s, 0.3).z;
  EXPECT_NEAR(still - before, 0.1, 1e-12) << "nothing of the blend where the law takes all";
}

TEST(ForceBlend, StaysContinuousWhenEveryTickChangesSomething) {
  ForceBlend blend;
  const rt::BlendParameters parameters;
  Vec3 before = blend.apply({4, 0, 0}, false, parameters, kStiffness, kTick_s);
  for (int i = 0; i < 300; ++i) {
    const Vec3 force = blend.apply({0, 4, 0}, true, parameters, kStiffness, kTick_s);
    EXPECT_LE(norm(force - before), kStiffness * rt::kFastestSurface_m_per_s * kTick_s + 1e-12);
    before = force;
  }
  EXPECT_LT(norm(before - Vec3{0, 4, 0}), 1e-3) << "it gets there all the same";
}

TEST(ForceBlend, ADurationOfZeroSwitchesItOff) {
  ForceBlend blend;
  blend.apply({1, 0, 0}, false, {.duration_s = 0}, kStiffness, kTick_s);
  EXPECT_EQ(blend.apply({3, 0, 0}, true, {.duration_s = 0}, kStiffness, kTick_s), (Vec3{3, 0, 0}));
}

TEST(ForceBlend, PassesNonFiniteForcesAndForgetsThem) {
  ForceBlend blend;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  blend.apply({1, 0, 0}, false, {}, kStiffness, kTick_s);
  EXPECT_FALSE(isFinite(blend.apply({nan, 0, 0}, true, {}, kStiffness, kTick_s)));
  EXPECT_TRUE(isFinite(blend.apply({1, 0, 0}, true, {}, kStiffness, kTick_s)));
}

}  // namespace
}  // namespace hapticd::test
