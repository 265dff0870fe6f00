// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/rt/closed_forms.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::test {
namespace {

constexpr double k = 500;
constexpr double D = 0.04;
constexpr double kFourDecimals = 0.5e-4 * 1.01;
constexpr double kTwoDecimals = 0.5e-2 * 1.01;

// Checks the closed forms used by other tests against independently tabulated values.

TEST(ClosedForms, GiveTheTabulatedPlaneForces) {
  struct Row {
    double a_N, h1, h5, h20, h30, peak_mm, peak_n;
  };
  for (const Row& r : {Row{0.005, 6.0584, 14.0685, 9.6969, 4.8630, 6.8602, 14.4476},
                       Row{0.010, 3.1200, 9.8607, 8.8854, 4.4733, 9.8444, 11.5697},
                       Row{0.020, 1.4025, 5.3078, 6.5685, 3.1665, 12.8842, 7.6102}}) {
    EXPECT_NEAR(planeForceOfNearest(k, D, r.a_N, 0.001), r.h1, kFourDecimals);
    EXPECT_NEAR(planeForceOfNearest(k, D, r.a_N, 0.005), r.h5, kFourDecimals);
    EXPECT_NEAR(planeForceOfNearest(k, D, r.a_N, 0.020), r.h20, kFourDecimals);
    EXPECT_NEAR(planeForceOfNearest(k, D, r.a_N, 0.030), r.h30, kFourDecimals);
    EXPECT_NEAR(planePeak(k, D, r.a_N).h_m * 1000, r.peak_mm, kFourDecimals);
    EXPECT_NEAR(planePeak(k, D, r.a_N).force_n, r.peak_n, kFourDecimals);
  }
  EXPECT_NEAR(planeForceOfAll(k, D, 0.002), 0.90476, 0.5e-5);
  EXPECT_NEAR(planeForceOfAll(k, D, 0.0165685), 3.43146, 0.5e-5);
  EXPECT_NEAR(planeForceOfAll(k, D, 0.039), 0.24684, 0.5e-5);
}

TEST(ClosedForms, GiveTheTabulatedSphereForces) {
  const double R = 0.05;
  EXPECT_NEAR(sphereForceOfAll(k, D, R, +1, 0), 1.3333, kFourDecimals);
  EXPECT_NEAR(sphereForceOfAll(k, D, R, -1, 0), -1.3333, kFourDecimals);
  EXPECT_NEAR(sphereForceOfAll(k, D, R, +1, 0.005), 3.0787, kFourDecimals);
  EXPECT_NEAR(sphereForceOfAll(k, D, R, -1, 0.005), 0.5581, kFourDecimals);
  EXPECT_NEAR(sphereForceOfAll(k, D, R, +1, 0.035), 1.1904, kFourDecimals);
  EXPECT_NEAR(sphereForceOfAll(k, D, R, -1, 0.035), 1.0324, kFourDecimals);
  // The table rounds a_N to 9.76 mm; the force changes by 0.25 N/mm with it.
  EXPECT_NEAR(sphereForceOfNearest(k, D, R, 0.00976, +1, 0.002), 6.5624, 2e-3);
  EXPECT_NEAR(sphereForceOfNearest(k, D, R, 0.00976, -1, 0.002), 4.7730, 2e-3);
  EXPECT_NEAR(sphereForceOfNearest(k, D, R, 0.010, +1, 0.020), 8.7033, kFourDecimals);
}

TEST(ClosedForms, GiveTheTabulatedEdgeForces) {
  EXPECT_NEAR(edgeLateralForce(k, D, 0.003), 4.07, kTwoDecimals);
  EXPECT_NEAR(edgeLateralForce(k, D, 0.010), 3.18, kTwoDecimals);
  EXPECT_NEAR(edgeLateralForce(k, D, 0.020), 1.76, kTwoDecimals);
}

}  // namespace
}  // namespace hapticd::test
