// SPDX-License-Identifier: Apache-2.0
// What frames of a camera with known noise show of it.
#include "tools/lib/depth_noise/depth_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr std::uint32_t kFrames = 24;
// standard error of a deviation from the pixels of a few correlated tiles, and what a plane takes with it
constexpr double kRelativeError = 0.06;

rt::DepthModelParameters stereo() {
  return tools::stereoCamera(kWidth, kHeight, 90, 0.05, 1e-4, 0.2, 3);
}

DepthNoise noiseOf(const rt::DepthModelParameters& camera, const tools::DepthAt& depth) {
  DepthNoise noise;
  for (std::uint32_t seed = 1; seed <= kFrames; ++seed) noise.add(*tools::frameOf(camera, depth, seed));
  return noise;
}

TEST(DepthNoise, FindsTheNoiseOfAStereoCamera) {
  const rt::DepthModelParameters camera = stereo();
  const DepthNoiseReport report = noiseOf(camera, tools::tiltedPlane(camera, 0.7, 0.6)).report();
  EXPECT_EQ(report.frames, kFrames);
  EXPECT_EQ(report.share_of_holes, 0);
  ASSERT_GT(report.at_depths.size(), 5U);
  for (const NoiseAtDepth& at : report.at_depths) {
    EXPECT_NEAR(at.temporal_m / camera.noise.sigma_m(at.depth_m), 1, kRelativeError) << at.depth_m;
  }
  // noise is alike over boxes of 5 pixels
  EXPECT_NEAR(report.correlation_px, camera.noise.correlation_px, 0.5);
  const auto fit = fittedNoise(report.at_depths, camera.principle);
  ASSERT_TRUE(fit);
  for (const double depth_m : {0.5, 0.8, 1.2}) {
    EXPECT_NEAR(fit->sigma_m(depth_m) / camera.noise.sigma_m(depth_m), 1, kRelativeError) << depth_m;
  }
  EXPECT_LT(fit->standing_share, 0.05);
}

TEST(DepthNoise, SeparatesWhatIsTheSameInEachFrame) {
  constexpr double kStatic_m = 0.003;
  const rt::DepthModelParameters camera = tools::timeOfFlightCamera(kWidth, kHeight);
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, kStatic_m);
  std::vector<double> static_m(std::size_t{kWidth} * kHeight);
  for (double& error_m : static_m) error_m = normal(random);
  const DepthNoise noise = noiseOf(camera, [&](double column, double row) {
    return 1 + static_m[static_cast<std::size_t>(row * kWidth + column)];
  });
  // all the pixels lie around 1 m, in one interval of depth or in two
  const std::vector<NoiseAtDepth> at_depths = noise.report().at_depths;
  ASSERT_FALSE(at_depths.empty());
  const NoiseAtDepth& at = at_depths.back();
  const double rounding_m = camera.unit_m / std::sqrt(12.0);
  EXPECT_NEAR(at.temporal_m / std::hypot(camera.noise.sigma_m(1), rounding_m), 1, kRelativeError);
  EXPECT_NEAR(at.static_m / kStatic_m, 1, kRelativeError);
  const auto fit = fittedNoise(at_depths, camera.principle);
  ASSERT_TRUE(fit);
  const double temporal_m2 = at.temporal_m * at.temporal_m;
  EXPECT_NEAR(fit->standing_share, at.static_m * at.static_m / (temporal_m2 + at.static_m * at.static_m),
              0.02);
  EXPECT_EQ(fit->c2_per_m, 0);
}

TEST(DepthNoise, FindsTheStandingShareOfASequence) {
  const rt::DepthModelParameters camera = stereo();
  tools::FrameSequence sequence(camera, tools::tiltedPlane(camera, 0.7, 0.6), 1);
  DepthNoise noise;
  for (std::uint32_t i = 0; i < kFrames; ++i) noise.add(*sequence.next());
  const auto fit = fittedNoise(noise.report().at_depths, camera.principle);
  ASSERT_TRUE(fit);
  // a plane takes 3 of the 40 independent patches of a tile
  EXPECT_NEAR(fit->standing_share, camera.noise.standing_share, 0.1);
  for (const double depth_m : {0.5, 0.8, 1.2}) {
    EXPECT_NEAR(fit->sigma_m(depth_m) / camera.noise.sigma_m(depth_m), 1, 0.1) << depth_m;
  }
}

TEST(FrameSequence, RepeatsItselfForASeedAndBeginsWithFrameOf) {
  const rt::DepthModelParameters camera = stereo();
  const auto plane = tools::tiltedPlane(camera, 0.7, 0.6);
  tools::FrameSequence first(camera, plane, 5);
  tools::FrameSequence again(camera, plane, 5);
  const auto a = first.next();
  const auto b = first.next();
  EXPECT_EQ(a->sequence, 1U);
  EXPECT_EQ(b->sequence, 2U);
  EXPECT_TRUE(std::ranges::equal(a->image(), again.next()->image()));
  EXPECT_TRUE(std::ranges::equal(b->image(), again.next()->image()));
  EXPECT_FALSE(std::ranges::equal(a->image(), b->image()));
  EXPECT_TRUE(std::ranges::equal(a->image(), tools::frameOf(camera, plane, 5)->image()));
  tools::FrameSequence exact(camera, plane, 0);
  EXPECT_TRUE(std::ranges::equal(exact.next()->image(), exact.next()->image()));
}

TEST(DepthNoise, IgnoresAPartThatMoves) {
  const rt::DepthModelParameters camera = stereo();
  const tools::DepthAt plane = tools::tiltedPlane(camera, 0.7, 0.6);
  DepthNoise noise;
  for (std::uint32_t seed = 1; seed <= kFrames; ++seed) {
    const double moved_m = 0.02 * (seed % 5);
    noise.add(*tools::frameOf(
        camera, [&](double column, double row) { return plane(column, row) + (column < 32 ? moved_m : 0); },
        seed));
  }
  const auto fit = fittedNoise(noise.report().at_depths, camera.principle);
  ASSERT_TRUE(fit);
  // where the plane is near, the motion is far above the noise; where it is far, within it
  EXPECT_NEAR(fit->sigma_m(0.6) / camera.noise.sigma_m(0.6), 1, 2 * kRelativeError);
}

TEST(DepthNoise, CountsHoles) {
  const rt::DepthModelParameters camera = stereo();
  const DepthNoise noise =
      noiseOf(camera, [](double column, double) { return column < kWidth / 4 ? 0 : 0.8; });
  EXPECT_DOUBLE_EQ(noise.report().share_of_holes, 0.25);
  EXPECT_EQ(noise.meanDepth_m().front(), 0);
  EXPECT_NEAR(noise.meanDepth_m().back(), 0.8, 0.02);
}

TEST(DepthNoise, MeasuresNothingFromAFewFrames) {
  const rt::DepthModelParameters camera = stereo();
  DepthNoise noise;
  for (std::uint32_t i = 1; i < DepthNoise::kMinMeasurements; ++i) {
    noise.add(*tools::frameOf(camera, tools::tiltedPlane(camera, 0.7, 0), i));
  }
  EXPECT_TRUE(noise.report().at_depths.empty());
  EXPECT_EQ(DepthNoise().report().frames, 0U);
}

TEST(DepthNoise, AnotherModeStartsAnew) {
  DepthNoise noise;
  for (const int width : {160, kWidth}) {
    const rt::DepthModelParameters camera = tools::stereoCamera(width, 100, 90, 0.05, 1e-4, 0.2, 3);
    noise.add(*tools::frameOf(camera, tools::tiltedPlane(camera, 0.7, 0)));
  }
  EXPECT_EQ(noise.report().frames, 1U);
  EXPECT_EQ(noise.camera().width_px, kWidth);
}

// --- the fit

std::vector<NoiseAtDepth> measuredBy(const rt::DepthNoiseParameters& noise,
                                     std::initializer_list<double> depths_m) {
  std::vector<NoiseAtDepth> at_depths;
  for (const double depth_m : depths_m) at_depths.push_back({depth_m, noise.sigma_m(depth_m), 0, 1000});
  return at_depths;
}

TEST(NoiseFit, FindsTheTermsThatTheMeasurementsHave) {
  for (const rt::DepthNoiseParameters noise :
       {rt::DepthNoiseParameters{.c2_per_m = 0.003}, rt::DepthNoiseParameters{.c0_m = 0.0005, .c1 = 0.0015},
        rt::DepthNoiseParameters{.c0_m = 0.002}}) {
    const auto fit = fittedNoise(measuredBy(noise, {0.3, 0.4, 0.5, 0.7, 0.9, 1.2, 1.6, 2.1, 3}),
                                 rt::DepthPrinciple::active_stereo);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->c0_m, noise.c0_m, 1e-9);
    EXPECT_NEAR(fit->c1, noise.c1, 1e-9);
    EXPECT_NEAR(fit->c2_per_m, noise.c2_per_m, 1e-9);
  }
}

TEST(NoiseFit, ANarrowSpanOfDepthsTakesTheTermOfThePrinciple) {
  const auto at_depths = measuredBy({.c0_m = 0.001}, {0.99, 1.0, 1.01});
  const auto stereo_fit = fittedNoise(at_depths, rt::DepthPrinciple::active_stereo);
  const auto flight_fit = fittedNoise(at_depths, rt::DepthPrinciple::time_of_flight);
  ASSERT_TRUE(stereo_fit && flight_fit);
  EXPECT_NEAR(stereo_fit->c2_per_m, 0.001, 1e-5);
  EXPECT_EQ(stereo_fit->c0_m, 0);
  EXPECT_NEAR(flight_fit->c0_m, 0.001, 1e-12);
  EXPECT_EQ(flight_fit->c2_per_m, 0);
}

TEST(NoiseFit, TakesTheShareFromDepthsWhereTheStandingPartWasMeasured) {
  std::vector<NoiseAtDepth> at_depths{
      {0.5, 0.001, 0.001, 1000}, {0.9, 0.001, 0, 5000}, {1.5, 0.001, 0.001, 1000}};
  at_depths[1].has_static = false;
  const auto fit = fittedNoise(at_depths, rt::DepthPrinciple::time_of_flight);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->standing_share, 0.5, 1e-12);
  EXPECT_NEAR(fit->c0_m, std::sqrt(2) * 0.001, 1e-12);
  for (NoiseAtDepth& at : at_depths) at.has_static = false, at.static_m = 0;
  const auto changing = fittedNoise(at_depths, rt::DepthPrinciple::time_of_flight);
  ASSERT_TRUE(changing);
  EXPECT_EQ(changing->standing_share, 0);
  EXPECT_NEAR(changing->c0_m, 0.001, 1e-12);
}

TEST(NoiseFit, NothingComesFromNothing) {
  EXPECT_FALSE(fittedNoise({}, rt::DepthPrinciple::active_stereo));
  EXPECT_FALSE(fittedNoise(std::vector<NoiseAtDepth>{{1, 0, 0, 1000}}, rt::DepthPrinciple::active_stereo));
}

// --- the picture

TEST(DepthPicture, DrawsNearAndFarAndHoles) {
  std::vector<double> depth_m;
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 12; ++column) depth_m.push_back(column < 4 ? 0.5 : column < 8 ? 1.0 : 0);
  }
  EXPECT_EQ(depthPicture(depth_m, 12, 8, 6), "@@..  \n@@..  \n");
  EXPECT_EQ(depthPicture(std::vector<double>(96, 0), 12, 8, 6), "");
}

}  // namespace
}  // namespace hapticd::tools
