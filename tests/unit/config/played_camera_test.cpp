// SPDX-License-Identifier: Apache-2.0
// What the configuration makes of the cameras that the driver `synthetic` plays.
#include <gtest/gtest.h>

#include "config/settings/settings.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "rt/depth/depth_model.h"

namespace hapticd::config {
namespace {

CameraSettings playing(drivers::PlayedCamera played) {
  CameraSettings camera;
  camera.driver = "synthetic";
  camera.of<drivers::SyntheticSettings>().played = played;
  return camera;
}

TEST(PlayedCamera, IsAKinectUnlessTheConfigurationNamesAnother) {
  CameraSettings camera;
  camera.driver = "synthetic";
  camera.width_px = 424;
  camera.unit_um = 100;
  EXPECT_EQ(camera.effectiveDepthModel(), rt::DepthModelParameters{});
  EXPECT_FALSE(camera.deliversDepth());
}

TEST(PlayedCamera, IsAnotherOnlyWithTheDriverSynthetic) {
  CameraSettings camera = playing(drivers::PlayedCamera::stereo);
  camera.driver = "freenect";
  EXPECT_EQ(camera.effectiveDepthModel(), rt::DepthModelParameters{});
  EXPECT_FALSE(camera.deliversDepth());
}

// f = 848 / (2 tan 45 deg) = 424 px, c2 = 0.08 px / (424 px 0.05 m)
TEST(PlayedCamera, OfStereoIsAD435) {
  const CameraSettings settings = playing(drivers::PlayedCamera::stereo);
  EXPECT_TRUE(settings.deliversDepth());
  const rt::DepthModelParameters camera = settings.effectiveDepthModel();
  EXPECT_EQ(rt::faultOf(camera), rt::CameraFault::none);
  EXPECT_EQ(camera.width_px, 848);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_NEAR(camera.fx_px, 424, 1e-9);
  EXPECT_NEAR(camera.fy_px, 424, 1e-9);
  EXPECT_EQ(camera.cx_px, 423.5);
  EXPECT_EQ(camera.cy_px, 239.5);
  EXPECT_EQ(camera.law, rt::DepthLawKind::linear);
  EXPECT_EQ(camera.unit_m, 1e-4);
  EXPECT_EQ(camera.raw_no_measurement, 0);
  EXPECT_EQ(camera.near_m, 0.4);
  EXPECT_EQ(camera.far_m, 4);
  EXPECT_EQ(camera.principle, rt::DepthPrinciple::active_stereo);
  EXPECT_NEAR(camera.noise.sigma_m(1), 0.08 / 21.2, 1e-12);
  EXPECT_NEAR(camera.noise.sigma_m(2), 4 * 0.08 / 21.2, 1e-12);
  EXPECT_GT(camera.noise.standing_share, 0);
  EXPECT_EQ(camera.noise.correlation_px, 5);
}

TEST(PlayedCamera, OfTimeOfFlightIsAFemtoMega) {
  const rt::DepthModelParameters camera =
      playing(drivers::PlayedCamera::time_of_flight).effectiveDepthModel();
  EXPECT_EQ(rt::faultOf(camera), rt::CameraFault::none);
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.height_px, 576);
  EXPECT_NEAR(camera.fx_px, 374.185, 0.5) << "as published";
  EXPECT_EQ(camera.unit_m, 1e-3);
  EXPECT_EQ(camera.principle, rt::DepthPrinciple::time_of_flight);
  EXPECT_NEAR(camera.noise.sigma_m(2) - camera.noise.sigma_m(1),
              camera.noise.sigma_m(3) - camera.noise.sigma_m(2), 1e-12)
      << "linear";
  EXPECT_GT(camera.noise.standing_share, 0);
  EXPECT_EQ(camera.noise.correlation_px, 1);
}

TEST(PlayedCamera, OfTimeOfFlightMayHaveTheUsualSizeOfAStereoCamera) {
  CameraSettings settings = playing(drivers::PlayedCamera::time_of_flight);
  settings.width_px = 848;
  EXPECT_EQ(settings.effectiveDepthModel().width_px, 848);
  EXPECT_EQ(settings.effectiveDepthModel().height_px, 576) << "left open";
  settings.height_px = 480;
  EXPECT_EQ(settings.effectiveDepthModel().width_px, 848);
  EXPECT_EQ(settings.effectiveDepthModel().height_px, 480);
}

TEST(PlayedCamera, OfTheDriverV4l2HasTheSizeOfAStereoCameraWhereItIsLeftOpen) {
  CameraSettings settings;
  settings.driver = "v4l2";
  EXPECT_EQ(settings.effectiveDepthModel().width_px, 848);
  EXPECT_EQ(settings.effectiveDepthModel().height_px, 480);
  settings.width_px = 640;
  EXPECT_EQ(settings.effectiveDepthModel().width_px, 640);
  EXPECT_EQ(settings.effectiveDepthModel().height_px, 480);
}

TEST(PlayedCamera, TakesWhatIsConfigured) {
  for (const drivers::PlayedCamera played :
       {drivers::PlayedCamera::stereo, drivers::PlayedCamera::time_of_flight}) {
    CameraSettings settings = playing(played);
    settings.width_px = 320;
    settings.height_px = 288;
    settings.unit_um = 250;
    settings.near_m = 0.2;
    settings.far_m = 2;
    settings.noise_c0_m = 0.001;
    settings.noise_c1 = 0.002;
    settings.noise_c2_per_m = 0.003;
    settings.noise_standing_share = 0.2;
    settings.noise_correlation_px = 3;
    rt::DepthModelParameters camera = settings.effectiveDepthModel();
    EXPECT_EQ(camera.width_px, 320);
    EXPECT_EQ(camera.height_px, 288);
    EXPECT_EQ(camera.unit_m, 250 * 1e-6);
    EXPECT_EQ(camera.near_m, 0.2);
    EXPECT_EQ(camera.far_m, 2);
    EXPECT_EQ(camera.noise, settings.noise());
    EXPECT_NE(camera.fx_px, settings.fx_px) << "those of the camera itself";
    settings.intrinsics = IntrinsicsSource::configured;
    camera = settings.effectiveDepthModel();
    EXPECT_EQ(camera.fx_px, settings.fx_px);
    EXPECT_EQ(camera.fy_px, settings.fy_px);
    EXPECT_EQ(camera.cx_px, settings.cx_px);
    EXPECT_EQ(camera.cy_px, settings.cy_px);
  }
}

// 16 bits of 100 um end at 6.5535 m.
TEST(PlayedCamera, HasAUnitThatReachesItsFarLimit) {
  CameraSettings settings = playing(drivers::PlayedCamera::stereo);
  settings.far_m = 6.55;
  EXPECT_EQ(settings.effectiveDepthModel().unit_m, 1e-4);
  settings.far_m = 6.56;
  EXPECT_EQ(settings.effectiveDepthModel().unit_m, 1e-3);
}

}  // namespace
}  // namespace hapticd::config
