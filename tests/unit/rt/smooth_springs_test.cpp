// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/smooth_springs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_model.h"
#include "rt/laws/force_laws.h"
#include "rt/laws/law_table.h"
#include "tests/unit/rt/scene/built_scene.h"

namespace hapticd::test {
namespace {

using rt::Vec3;

constexpr std::uint16_t kRaw = 750;

/// A wall and the law above it.
class SmoothSpringsOnAWall {
 public:
  SmoothSpringsOnAWall() : scene_(model_, wholeFrameGrid()), laws_(scene_.builder.pointCapacity()) {
    auto frame = std::make_unique<rt::DepthFrame>();
    std::fill_n(frame->raw, drivers::kKinectPixels, kRaw);
    frame->sequence = 1;
    frame->arrival_ns = 0;
    scene_.build(*frame);
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

}  // namespace
}  // namespace hapticd::test
