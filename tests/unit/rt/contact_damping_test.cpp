// SPDX-License-Identifier: Apache-2.0
#include "rt/contact_damping.h"

#include <gtest/gtest.h>

namespace hapticd::test {
namespace {

using rt::Vec3;

constexpr Vec3 kLifts{0, 0, 0.3};  // a surface that moves towards the hand, m/s

TEST(VelocityToDamp, IsTheHandsOwnOnASurfaceAtRest) {
  EXPECT_EQ(rt::velocityToDamp({0.1, -0.2, 0.3}, {}), (Vec3{0.1, -0.2, 0.3}));
}

TEST(VelocityToDamp, DoesNotOpposeASurfaceThatLiftsTheHand) {
  EXPECT_EQ(rt::velocityToDamp({0.1, 0, 0.2}, kLifts), (Vec3{0.1, 0, 0}));
  EXPECT_NEAR(rt::velocityToDamp({0.1, 0, 0.5}, kLifts).z, 0.2, 1e-12);
}

TEST(VelocityToDamp, IsUnchangedForAHandThatRestsOrMovesAgainstTheSurface) {
  EXPECT_EQ(rt::velocityToDamp({}, kLifts), Vec3{});
  EXPECT_EQ(rt::velocityToDamp({0, 0, -0.2}, kLifts), (Vec3{0, 0, -0.2}));
}

}  // namespace
}  // namespace hapticd::test
