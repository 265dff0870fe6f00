// SPDX-License-Identifier: Apache-2.0
// Checks the noise against the model that the camera states. Tolerances: five standard errors of a mean over
// independent patches (the seeds are fixed), as for the noise of the Kinect.
#include "drivers/camera/synthetic/depth_sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "drivers/camera/synthetic/edge_errors.h"

namespace hapticd::drivers {
namespace {

using Image = std::vector<float>;

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr int kSeeds = 40;
constexpr double kStandardErrors = 5;
// numbers in single precision, near 3 and for differences of 0.001
constexpr double kSingle = 1e-3;

rt::DepthModelParameters cameraWith(const rt::DepthNoiseParameters& noise) {
  rt::DepthModelParameters camera;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.law = rt::DepthLawKind::linear;
  camera.noise = noise;
  return camera;
}

/// Every depth from 0.5 to 3.5 m, shifted.
Image ramp(double shift_m = 0) {
  Image depths_m;
  for (int i = 0; i < kWidth * kHeight; ++i)
    depths_m.push_back(static_cast<float>(0.5 + 3.0 * i / (kWidth * kHeight) + shift_m));
  return depths_m;
}

/// The errors of a frame in standard deviations.
Image errorsOf(const rt::DepthModelParameters& camera, std::uint32_t seed, std::uint64_t frame,
               const Image& exact_m, double scale = 1) {
  Image errors = exact_m;
  CameraNoise(camera, seed, scale).addTo(frame, errors);
  for (std::size_t i = 0; i < errors.size(); ++i)
    errors[i] = (errors[i] - exact_m[i]) / static_cast<float>(camera.noise.sigma_m(double{exact_m[i]}));
  return errors;
}

/// Mean over pixels of the product of two images, the second shifted to the right and down.
double meanProduct(const Image& a, const Image& b, int right = 0, int down = 0) {
  double sum = 0;
  double count = 0;
  for (int row = 0; row + down < kHeight; ++row) {
    for (int column = 0; column + right < kWidth; ++column) {
      const auto here = static_cast<std::size_t>(row * kWidth + column);
      const auto there = here + static_cast<std::size_t>(down * kWidth + right);
      sum += double{a[here]} * double{b[there]};
      count += 1;
    }
  }
  return sum / count;
}

/// Of a covariance of errors with variance 1, or of half of the error of their variance.
double toleranceOf(const rt::DepthNoiseParameters& noise) {
  const double patches = kSeeds * double{kWidth} * kHeight / (noise.correlation_px * noise.correlation_px);
  return kStandardErrors / std::sqrt(patches) + kSingle;
}

const rt::DepthNoiseParameters kModels[] = {
    {.c2_per_m = 0.004, .standing_share = 0.5, .correlation_px = 5},
    {.c0_m = 0.0005, .c1 = 0.0015, .standing_share = 0.3, .correlation_px = 1},
    {.c0_m = 0.001, .c1 = 0.001, .c2_per_m = 0.001, .standing_share = 0.8, .correlation_px = 4}};

TEST(CameraNoise, HasTheStatedDeviationShareAndCorrelation) {
  for (const rt::DepthNoiseParameters& noise : kModels) {
    const rt::DepthModelParameters camera = cameraWith(noise);
    const int window = static_cast<int>(noise.correlation_px);
    double variance = 0, common = 0, beside = 0, below = 0, beyond = 0;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
      const Image first = errorsOf(camera, seed, 7, ramp());
      const Image later = errorsOf(camera, seed, 8, ramp());
      variance += meanProduct(first, first) / kSeeds;
      common += meanProduct(first, later) / kSeeds;
      beside += meanProduct(first, first, 1, 0) / kSeeds;
      below += meanProduct(first, first, 0, 1) / kSeeds;
      beyond += meanProduct(first, first, window, 0) / kSeeds;
    }
    const double tolerance = toleranceOf(noise);
    EXPECT_NEAR(variance, 1, std::sqrt(2) * tolerance);
    EXPECT_NEAR(common, noise.standing_share, tolerance);
    EXPECT_NEAR(beside, 1 - 1 / noise.correlation_px, tolerance);
    EXPECT_NEAR(below, 1 - 1 / noise.correlation_px, tolerance);
    EXPECT_NEAR(beyond, 0, tolerance);
  }
}

TEST(CameraNoise, IsNormalWherePixelsAreIndependent) {
  const rt::DepthModelParameters camera = cameraWith(kModels[1]);
  double fourth = 0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    for (const float error : errorsOf(camera, seed, 1, ramp())) fourth += std::pow(double{error}, 4);
  }
  const double pixels = double{kSeeds} * kWidth * kHeight;
  // The variance of x^4 is 96; quantiles of 4096 shares lack the outermost tails, which hold 1 % of it.
  EXPECT_NEAR(fourth / pixels, 3, kStandardErrors * std::sqrt(96 / pixels) + 0.03);
}

TEST(CameraNoise, RepeatsWhatStandsStillAndChangesItWithTheDepth) {
  rt::DepthNoiseParameters noise = kModels[0];
  noise.standing_share = 1;
  const rt::DepthModelParameters camera = cameraWith(noise);
  double moved_a_little = 0, moved = 0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const Image errors = errorsOf(camera, seed, 1, ramp());
    ASSERT_EQ(errors, errorsOf(camera, seed, 5000, ramp()));
    // two standard deviations at 3.5 m are 0.098 m; at 0.5 m a fiftieth of that is as much
    moved += meanProduct(errors, errorsOf(camera, seed, 1, ramp(0.098))) / kSeeds;
    moved_a_little += meanProduct(errors, errorsOf(camera, seed, 1, ramp(1e-5))) / kSeeds;
  }
  EXPECT_NEAR(moved, CameraNoise::kShareOfPixel, toleranceOf(noise));
  // 1e-5 m are at most a hundredth of the standard deviation of 1 mm at 0.5 m; the weights of two levels turn
  // by a sixty-fourth of a right angle
  EXPECT_GT(moved_a_little, 0.99);
}

TEST(CameraNoise, GrowsByTheScale) {
  const rt::DepthModelParameters camera = cameraWith(kModels[0]);
  double variance = 0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const Image errors = errorsOf(camera, seed, 1, ramp(), 2);
    variance += meanProduct(errors, errors) / kSeeds;
  }
  EXPECT_NEAR(variance / 4, 1, std::sqrt(2) * toleranceOf(kModels[0]));
}

TEST(CameraNoise, InventsNothingAndCarriesNothingBehindTheCamera) {
  rt::DepthNoiseParameters noise = kModels[0];
  noise.c0_m = 5;  // often more than the depth
  Image depths_m(std::size_t{kWidth} * kHeight, 1);
  std::fill_n(depths_m.begin(), kWidth, kNothingSeen);
  CameraNoise(cameraWith(noise), 1).addTo(1, depths_m);
  EXPECT_TRUE(
      std::all_of(depths_m.begin(), depths_m.begin() + kWidth, [](float z) { return z == kNothingSeen; }));
  EXPECT_TRUE(std::all_of(depths_m.begin() + kWidth, depths_m.end(), [](float z) { return z >= 0; }));
  EXPECT_GT(std::ranges::count(depths_m, 0.0F), 0);
}

}  // namespace
}  // namespace hapticd::drivers
