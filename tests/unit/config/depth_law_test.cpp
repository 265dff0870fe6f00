// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/settings.h"

namespace hapticd::config {
namespace {

double depthOf(const rt::DepthModelParameters& model, int raw) {
  return 1 / (model.a_per_m * raw + model.b_per_m);
}

TEST(DepthLaw, PaperIsTableIWhateverTheCustomCoefficientsAre) {
  CameraSettings camera;
  camera.depth_model.a_per_m = -0.002;
  camera.depth_model.b_per_m = 2;
  const rt::DepthModelParameters model = camera.effectiveDepthModel();
  EXPECT_EQ(model.a_per_m, -0.003071102);
  EXPECT_EQ(model.b_per_m, 3.330949516);
}

TEST(DepthLaw, FactoryIsWhatTheDriverComputesFromTheCamerasConstants) {
  CameraSettings camera;
  camera.depth_law = DepthLaw::factory;
  const rt::DepthModelParameters model = camera.effectiveDepthModel();
  for (const int raw : {1, 400, 600, 1000, 1049}) {
    // The driver's own form of the law. 1e-12 relative: a dozen roundings in double precision, amplified by
    // the cancellation in the denominator (28.4 - 27.3 at raw 1049).
    const double expected_m = 9 / (28.379075 - 0.02605 * raw);
    EXPECT_NEAR(depthOf(model, raw), expected_m, 1e-12 * expected_m) << raw;
  }
  // 705 mm at raw 600, known to the millimetre from the driver's tables.
  EXPECT_NEAR(depthOf(model, 600), 0.705, 0.0015);
}

TEST(DepthLaw, CustomTakesTheConfiguredCoefficients) {
  CameraSettings camera;
  camera.depth_law = DepthLaw::custom;
  camera.depth_model.a_per_m = -0.002;
  camera.depth_model.b_per_m = 2;
  const rt::DepthModelParameters model = camera.effectiveDepthModel();
  EXPECT_EQ(model.a_per_m, -0.002);
  EXPECT_EQ(model.b_per_m, 2);
}

TEST(DepthLaw, LeavesLimitsAndIntrinsicsAlone) {
  CameraSettings camera;
  camera.depth_law = DepthLaw::factory;
  camera.depth_model.near_m = 0.6;
  camera.depth_model.far_m = 2;
  camera.depth_model.fx_px = 575.8;
  const rt::DepthModelParameters model = camera.effectiveDepthModel();
  EXPECT_EQ(model.near_m, 0.6);
  EXPECT_EQ(model.far_m, 2);
  EXPECT_EQ(model.fx_px, 575.8);
}

}  // namespace
}  // namespace hapticd::config
