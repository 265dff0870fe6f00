// SPDX-License-Identifier: Apache-2.0
// What the measurement of depth noise finds in frames of each camera that the synthetic camera plays, and
// what a hand feels of them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "config/settings/settings.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "tools/lib/depth_noise/depth_noise.h"
#include "tools/lib/offline/offline_box.h"

namespace hapticd::tools {
namespace {

using drivers::PlayedCamera;
using drivers::SyntheticNoise;
using drivers::SyntheticScene;

constexpr int kFrames = 32;
constexpr double kPeriod_s = 1.0 / 30;

rt::DepthModelParameters modelOf(PlayedCamera played) {
  config::CameraSettings settings;
  settings.driver = "synthetic";
  settings.of<drivers::SyntheticSettings>().played = played;
  return settings.effectiveDepthModel();
}

drivers::SyntheticSettings plane(double tilt_rad, SyntheticNoise noise = SyntheticNoise::sensor) {
  drivers::SyntheticSettings settings;
  settings.scene = SyntheticScene::plane;
  settings.noise = noise;
  settings.tilt_rad = tilt_rad;
  return settings;
}

DepthNoiseReport reportOf(const drivers::SyntheticSettings& settings,
                          const rt::DepthModelParameters& camera) {
  drivers::AnalyticScene scene(settings, camera);
  DepthNoise noise;
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (int i = 0; i < kFrames; ++i) {
    scene.render(i * kPeriod_s, *frame);
    noise.add(*frame);
  }
  return noise.report();
}

/// Bounds of agreement. A deviation from tiles of 32 x 32 pixels that hold 40 independent patches of 5
/// pixels, of which a plane takes 3: 4 % too small in the standing half, and 5 % from three tiles at the
/// least. The rounding to 1 mm adds 4 % at the nearest depth.
constexpr double kOfSigma = 0.1;
constexpr double kOfShare = 0.1;
constexpr double kOfLength_px = 1;

class NoiseOfAPlayedCamera : public testing::TestWithParam<PlayedCamera> {};

TEST_P(NoiseOfAPlayedCamera, IsMeasuredAsStated) {
  const rt::DepthModelParameters camera = modelOf(GetParam());
  const DepthNoiseReport report = reportOf(plane(0.9), camera);
  const auto fit = fittedNoise(report.at_depths, camera.principle);
  ASSERT_TRUE(fit);
  int compared = 0;
  for (const NoiseAtDepth& at : report.at_depths) {
    if (!at.has_static) continue;
    EXPECT_NEAR(at.sigma_m() / camera.noise.sigma_m(at.depth_m), 1, kOfSigma) << at.depth_m;
    ++compared;
  }
  EXPECT_GT(compared, 8);
  for (const double depth_m : {0.7, 1.0, 1.5, 2.0, 3.0})
    EXPECT_NEAR(fit->sigma_m(depth_m) / camera.noise.sigma_m(depth_m), 1, kOfSigma) << depth_m;
  EXPECT_NEAR(fit->standing_share, camera.noise.standing_share, kOfShare);
  EXPECT_NEAR(report.correlation_px, camera.noise.correlation_px, kOfLength_px);
  std::printf("%s: sigma(1 m) %.2f mm of %.2f, standing %.2f of %.2f, correlation %.1f px of %.0f\n",
              std::string(rt::wordOf(GetParam())).c_str(), 1e3 * fit->sigma_m(1),
              1e3 * camera.noise.sigma_m(1), fit->standing_share, camera.noise.standing_share,
              report.correlation_px, camera.noise.correlation_px);
}

INSTANTIATE_TEST_SUITE_P(Kinds, NoiseOfAPlayedCamera,
                         testing::Values(PlayedCamera::stereo, PlayedCamera::time_of_flight),
                         [](const auto& kind) { return std::string(rt::wordOf(kind.param)); });

// A Kinect states no noise; what its pattern has follows from its parameters. Rounding to raw units adds
// 1/12, of which exp(-2 pi^2 2 fast^2) / (2 pi^2) is the same in each frame, and which hardly correlates
// between pixels.
TEST(NoiseOfAPlayedKinect, IsThatOfItsPatternAndOfRounding) {
  const rt::DepthModelParameters camera = modelOf(PlayedCamera::kinect);
  const drivers::NoisePatternParameters pattern = drivers::SensorNoise::harsh().pattern;
  const double pi = std::acos(-1);
  const double fast = pattern.fast_raw * pattern.fast_raw;
  const double rounding = 1.0 / 12;
  const double same_rounding = std::exp(-4 * pi * pi * fast) / (2 * pi * pi);
  const double standing = pattern.static_raw * pattern.static_raw + same_rounding;
  const double changing = fast + rounding - same_rounding;
  double length_px = 1;
  for (int lag = 1; lag < drivers::NoisePattern::kWindow; ++lag)
    length_px += 2 * fast / changing * (1 - static_cast<double>(lag) / drivers::NoisePattern::kWindow);

  const DepthNoiseReport report = reportOf(plane(0.9, SyntheticNoise::harsh), camera);
  const auto fit = fittedNoise(report.at_depths, camera.principle);
  ASSERT_TRUE(fit);
  // In a tile of 32 pixels there are 12.6 patches of 9, of which a plane takes 3.
  const double kept = 1 - 3 * 81 / 1024.0;
  const double sigma_raw = std::sqrt(changing + kept * standing);
  for (const double depth_m : {0.8, 1.0, 1.5}) {
    const double expected_m = sigma_raw * std::abs(camera.a_per_m) * depth_m * depth_m;
    EXPECT_NEAR(fit->sigma_m(depth_m) / expected_m, 1, kOfSigma) << depth_m;
  }
  EXPECT_NEAR(fit->standing_share, kept * standing / (changing + kept * standing), kOfShare);
  EXPECT_NEAR(report.correlation_px, length_px, kOfLength_px);
}

// The law `surface` fits planes to windows that grow where the surface is plane, to at least nine independent
// patches of the noise of any camera here; these leave a third of its deviation.
TEST(AHand, FeelsAPlaneWithEachPlayedCamera) {
  for (const PlayedCamera played :
       {PlayedCamera::kinect, PlayedCamera::stereo, PlayedCamera::time_of_flight}) {
    rt::DepthModelParameters camera = modelOf(played);
    const double sigma_m = camera.noise.isKnown()
                               ? camera.noise.sigma_m(1)
                               : 0.6 * std::abs(camera.a_per_m);  // raw units of recorded()
    drivers::AnalyticScene scene(plane(0), camera);
    const auto frame = std::make_unique<rt::DepthFrame>();
    OfflineBox box(camera, {}, {});
    box.parameters().law = rt::ForceLaw::surface;
    const double stiffness = box.parameters().force.stiffness_n_per_m;
    constexpr double kPressed_m = 0.008;
    double squares = 0;
    int places = 0;
    for (int i = 0; i < 20; ++i) {
      scene.render(i * kPeriod_s, *frame);
      frame->sequence = static_cast<std::uint64_t>(i) + 1;
      box.show(*frame);
      const rt::Vec3 above{0.03 * (i % 5 - 2), 0.03 * (i / 5 - 1.5), -0.98};
      box.core().release();
      rt::Vec3 force;
      for (int step = 0; step <= 28; ++step)
        force = box.lawForce(above - rt::Vec3{0, 0, (0.02 + kPressed_m) * step / 28}).force_n_in_world;
      EXPECT_LT(std::hypot(force.x, force.y), force.z) << "outwards";
      squares += (force.z / stiffness - kPressed_m) * (force.z / stiffness - kPressed_m);
      ++places;
    }
    const double error_m = std::sqrt(squares / places);
    std::printf("%s: the surface errs by %.2f of a pixel's deviation\n",
                std::string(rt::wordOf(played)).c_str(), error_m / sigma_m);
    EXPECT_LT(error_m, sigma_m / 3) << rt::wordOf(played);
  }
}

}  // namespace
}  // namespace hapticd::tools
