// SPDX-License-Identifier: Apache-2.0
// What the configuration makes of cameras, and the law that auto chooses by what they see.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "config/settings/law_choice.h"
#include "config/settings/settings.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/handle/simulated/simulated_handle.h"
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

double depthOf(const rt::DepthModelParameters& model, int raw) {
  return 1 / (model.a_per_m * raw + model.b_per_m);
}

TEST(DepthLaw, PaperIsTableIWhateverTheCustomCoefficientsAre) {
  CameraSettings camera;
  camera.depth_a_per_m = -0.002;
  camera.depth_b_per_m = 2;
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
  camera.depth_a_per_m = -0.002;
  camera.depth_b_per_m = 2;
  const rt::DepthModelParameters model = camera.effectiveDepthModel();
  EXPECT_EQ(model.a_per_m, -0.002);
  EXPECT_EQ(model.b_per_m, 2);
}

TEST(DepthLaw, LeavesLimitsAndIntrinsicsAlone) {
  CameraSettings camera;
  camera.depth_law = DepthLaw::factory;
  camera.near_m = 0.6;
  camera.far_m = 2;
  camera.fx_px = 575.8;
  const rt::DepthModelParameters model = camera.effectiveDepthModel();
  EXPECT_EQ(model.near_m, 0.6);
  EXPECT_EQ(model.far_m, 2);
  EXPECT_EQ(model.fx_px, 575.8);
}

constexpr double kStiffness = 500;

/// How a Kinect v1 sees a surface at a distance.
SurfaceAsSeen atDistance(double distance_m) {
  return asSeenBy({}, distance_m);
}

/// Noises and pitches of the table, which was measured at distances from a Kinect v1.
std::vector<SurfaceAsSeen> measuredSurfaces() {
  std::vector<SurfaceAsSeen> all;
  for (const MeasuredLaw& measured : measuredLaws()) {
    if (measured.law == rt::ForceLaw::surface) all.push_back({measured.noise_m, measured.pitch_m});
  }
  return all;
}

TEST(MeasuredLaws, KnowEachLawWithEachNoiseAndPitch) {
  std::set<double> noises_m;
  std::set<double> pitches_m;
  for (const SurfaceAsSeen& seen : measuredSurfaces()) {
    noises_m.insert(seen.noise_m);
    pitches_m.insert(seen.pitch_m);
    std::set<rt::ForceLaw> laws;
    for (const MeasuredLaw& measured : measuredLaws()) {
      if (measured.noise_m == seen.noise_m) laws.insert(measured.law);
      EXPECT_GT(measured.error_m, 0);
      EXPECT_GT(measured.cpu_ms_per_s, 0);
    }
    EXPECT_EQ(laws.size(), 4U) << seen.noise_m;
  }
  EXPECT_EQ(noises_m.size(), measuredSurfaces().size());
  EXPECT_EQ(pitches_m.size(), measuredSurfaces().size());
  for (const MeasuredLaw& measured : measuredLaws()) {
    EXPECT_TRUE(noises_m.contains(measured.noise_m)) << measured.noise_m;
    EXPECT_TRUE(pitches_m.contains(measured.pitch_m)) << measured.pitch_m;
  }
}

TEST(ChooseLaw, ChoosesTheCheapestWithinTheError) {
  for (const SurfaceAsSeen& seen : measuredSurfaces()) {
    for (const double max_error_n : {0.05, 0.28, 1.0, 10.0, 100.0}) {
      const LawDecision decision = chooseLaw(max_error_n, kStiffness, seen);
      double cheapest = 1e9;
      double cost = 1e9;
      for (const MeasuredLaw& measured : measuredLaws()) {
        if (measured.noise_m != seen.noise_m) continue;
        if (kStiffness * measured.error_m <= max_error_n)
          cheapest = std::min(cheapest, measured.cpu_ms_per_s);
        if (measured.law == decision.law && measured.filtered == decision.filtered)
          cost = measured.cpu_ms_per_s;
      }
      if (!decision.within) continue;
      EXPECT_LE(decision.error_n, max_error_n);
      EXPECT_EQ(cost, cheapest) << seen.noise_m << " " << max_error_n;
    }
  }
}

TEST(ChooseLaw, ChoosesAndNamesTheMostAccurateWhereNoneIsWithinTheError) {
  const LawDecision decision = chooseLaw(1e-6, kStiffness, atDistance(3.5));
  EXPECT_FALSE(decision.within);
  for (const MeasuredLaw& measured : measuredLaws()) {
    if (measured.noise_m != atDistance(3.5).noise_m) continue;
    EXPECT_GE(kStiffness * measured.error_m, decision.error_n);
  }
  EXPECT_NE(decision.reason.find("none of"), std::string::npos) << decision.reason;
}

TEST(MeasuredLaws, FilterOnlyLawsOnPoints) {
  for (const MeasuredLaw& measured : measuredLaws()) {
    if (measured.law == rt::ForceLaw::surface) {
      EXPECT_FALSE(measured.filtered) << measured.noise_m;
    }
  }
}

// 20 %: one setting may be this much worse than the best at any distance, so that little is left to choose.
TEST(MeasuredLaws, HaveInSurfaceOneSettingThatIsNearlyTheMostAccurateEverywhere) {
  for (const SurfaceAsSeen& seen : measuredSurfaces()) {
    double least_m = 1e9;
    double surface_m = 1e9;
    for (const MeasuredLaw& measured : measuredLaws()) {
      if (measured.noise_m != seen.noise_m) continue;
      least_m = std::min(least_m, measured.error_m);
      if (measured.law == rt::ForceLaw::surface) surface_m = measured.error_m;
    }
    EXPECT_LE(surface_m, 1.2 * least_m) << seen.noise_m;
  }
}

TEST(ChooseLaw, ScalesTheErrorWithTheStiffness) {
  EXPECT_DOUBLE_EQ(chooseLaw(1e-6, 1000, atDistance(1)).error_n,
                   2 * chooseLaw(1e-6, 500, atDistance(1)).error_n);
}

TEST(SteadySurface, StaysUntilATwentiethOfTheDistanceHasPassed) {
  const SurfaceAsSeen before = atDistance(1);
  EXPECT_EQ(steady(atDistance(1.04), before), before);
  EXPECT_EQ(steady(atDistance(0.96), before), before);
  EXPECT_EQ(steady(atDistance(1.06), before), atDistance(1.06));
  EXPECT_EQ(steady(atDistance(0.94), before), atDistance(0.94));
  EXPECT_EQ(steady(before, {}), before);
}

TEST(ExpectedError, IsInterpolatedBetweenTheMeasurements) {
  const std::vector<SurfaceAsSeen> measured = measuredSurfaces();
  const auto expected = [](double noise_m) { return expectedError_m(rt::ForceLaw::surface, false, noise_m); };
  const auto of_row = [](double noise_m) {
    for (const MeasuredLaw& row : measuredLaws()) {
      if (row.law == rt::ForceLaw::surface && row.noise_m == noise_m) return row.error_m;
    }
    return -1.0;
  };
  for (std::size_t i = 0; i < measured.size(); ++i) {
    EXPECT_NEAR(expected(measured[i].noise_m) / of_row(measured[i].noise_m), 1, 1e-9);
    if (i == 0) continue;
    const double between_m = std::sqrt(measured[i - 1].noise_m * measured[i].noise_m);
    EXPECT_NEAR(expected(between_m), std::sqrt(of_row(measured[i - 1].noise_m) * of_row(measured[i].noise_m)),
                1e-9);
  }
  EXPECT_EQ(expected(0.5 * measured.front().noise_m), of_row(measured.front().noise_m));
  EXPECT_EQ(expected(2 * measured.back().noise_m), of_row(measured.back().noise_m));
}

TEST(ChooseLaw, TakesTheErrorFromTheNoiseAndTheCostFromThePitch) {
  const SurfaceAsSeen near = measuredSurfaces().front();
  const SurfaceAsSeen far = measuredSurfaces().back();
  // of all that is accurate enough, the cheapest at the pitch
  const double most_n = 100;
  const auto costOf = [](const LawDecision& decision, double pitch_m) {
    for (const MeasuredLaw& measured : measuredLaws()) {
      if (measured.law == decision.law && measured.filtered == decision.filtered &&
          measured.pitch_m == pitch_m)
        return measured.cpu_ms_per_s;
    }
    return -1.0;
  };
  for (const SurfaceAsSeen& seen : {near, far, SurfaceAsSeen{near.noise_m, far.pitch_m}}) {
    const LawDecision decision = chooseLaw(most_n, kStiffness, seen);
    for (const MeasuredLaw& measured : measuredLaws()) {
      if (measured.pitch_m != seen.pitch_m) continue;
      EXPECT_GE(measured.cpu_ms_per_s, costOf(decision, seen.pitch_m));
    }
  }
  // with a fine pitch and much noise, the error is that of the noise
  const SurfaceAsSeen noisy{far.noise_m, near.pitch_m};
  EXPECT_EQ(chooseLaw(1e-6, kStiffness, noisy).error_n, chooseLaw(1e-6, kStiffness, far).error_n);
}

TEST(LawsThatMayAct, HoldEachChoiceBetweenTheMeasurementsToo) {
  Settings settings;
  for (const double max_error_n : {0.05, 0.28, 3.0, 12.0}) {
    settings.live.force.max_error_n = max_error_n;
    const std::vector<rt::LiveParameters> laws = lawsThatMayAct(settings);
    for (double distance_m = 0.4; distance_m < 5; distance_m *= 1.01) {
      const LawDecision decision = chooseLaw(settings, atDistance(distance_m));
      EXPECT_TRUE(std::ranges::any_of(laws, [&](const rt::LiveParameters& live) {
        return live.law == decision.law && live.filter.isOff() != decision.filtered;
      })) << distance_m;
    }
  }
}

TEST(EffectiveMaxError, IsSevenPercentOfTheForceLimitUnlessOneIsSet) {
  Settings settings;
  settings.live.safety.max_force_n = 4;
  EXPECT_DOUBLE_EQ(settings.effectiveMaxError_n(), 0.28);
  settings.live.force.max_error_n = 0.5;
  EXPECT_DOUBLE_EQ(settings.effectiveMaxError_n(), 0.5);
}

TEST(StartParameters, AreThoseOfHandleAndCamera) {
  Settings settings;
  settings.handle.motion_scale = 2;
  settings.handle.force_scale = 0.5;
  settings.handle.device_damping_n_s_per_m = 0.1;
  settings.handle.damping_n_s_per_m = 3;
  settings.camera.latency_s = 0.06;
  settings.handle.of<drivers::SimulatedHandleSettings>().mass_kg = 0.3;
  EXPECT_EQ(settings.startParameters().device_mass_kg, 0.3) << "the stiffness limit depends on it";
  settings.handle.device_mass_kg = 0.2;
  const rt::StartParameters start = settings.startParameters();
  EXPECT_EQ(start.handle.motion_scale, 2);
  EXPECT_EQ(start.handle.force_scale, 0.5);
  EXPECT_EQ(start.handle.device_damping_n_s_per_m, 0.1);
  EXPECT_EQ(start.handle.damping_n_s_per_m, 3);
  EXPECT_EQ(start.device_mass_kg, 0.2);
  EXPECT_EQ(start.camera_latency_s, 0.06);
}

TEST(LiveWith, TakesLawAndFilterAndLeavesTheRest) {
  Settings settings;
  settings.live.force.stiffness_n_per_m = 321;
  settings.live.filter.hold_frames = 9;
  settings.live.surface.fusion_frames = 5;
  const rt::LiveParameters live =
      liveWith(settings, {.law = rt::ForceLaw::proxy, .filtered = true, .reason = {}});
  EXPECT_EQ(live.law, rt::ForceLaw::proxy);
  EXPECT_EQ(live.filter, filterOfChoice());
  EXPECT_EQ(live.force.stiffness_n_per_m, 321);
  EXPECT_EQ(live.surface.fusion_frames, 5);
  EXPECT_TRUE(liveWith(settings, {.law = rt::ForceLaw::surface, .reason = {}}).filter.isOff());
}

TEST(SurfaceSeenByACamera, FollowsFromItsNoiseItsCorrelationAndItsPixels) {
  const SurfaceAsSeen kinect = asSeenBy({}, 1);
  // Over 12 pixels the correlation of 1 - d / 9 leaves (12 + 2 (11 8 + 10 7 + ... + 4 1) / 9) / 144 = 0.5648.
  EXPECT_NEAR(kinect.noise_m, 0.54 * 0.003071102 * 0.5648, 1e-6);
  EXPECT_NEAR(kinect.pitch_m, 1 / 594.214342, 1e-9);
  EXPECT_NEAR(asSeenBy({}, 2).noise_m, 4 * kinect.noise_m, 1e-9);

  rt::DepthModelParameters stereo;
  stereo.law = rt::DepthLawKind::linear;
  stereo.fx_px = 400;
  stereo.unit_m = 1e-9;  // no rounding
  EXPECT_EQ(asSeenBy(stereo, 1).noise_m, kinect.noise_m) << "its noise is not known";
  EXPECT_NEAR(asSeenBy(stereo, 1).pitch_m, 0.0025, 1e-12);
  stereo.noise = {.c0_m = 0.54 * 0.003071102};  // the same everywhere, as a Kinect's at 1 m
  EXPECT_NEAR(asSeenBy(stereo, 0.2).noise_m, kinect.noise_m, 1e-9);
  EXPECT_NEAR(asSeenBy(stereo, 3).noise_m, kinect.noise_m, 1e-9);
  stereo.unit_m = 0.012;  // its rounding has a deviation of 0.012 / sqrt(12)
  EXPECT_NEAR(asSeenBy(stereo, 1).noise_m / kinect.noise_m, std::hypot(1, 0.012 / 3.4641 / 0.00165840), 1e-4);
  stereo.unit_m = 1e-9;
  stereo.noise.correlation_px = 1;  // independent pixels: their mean over 12 x 12 has a twelfth
  EXPECT_NEAR(asSeenBy(stereo, 1).noise_m, 0.54 * 0.003071102 / 12, 1e-9);
}

}  // namespace
}  // namespace hapticd::config
