// SPDX-License-Identifier: Apache-2.0
// The floor of patches against the fact sheet's table (truth.md, section 2) and against a dense solution of
// the same problem; that of bodies against the sheet's (section 7) and against fits to synthetic noise.

#include "tools/lib/truth/noise_floor.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace hapticd::tools {
namespace {

using drivers::NoisePattern;
using drivers::SensorNoise;
using rt::Vec3;

constexpr double kStiffness_n_per_m = 500;

FloorError floorOf(const SensorNoise::Parameters& noise, const FloorPatch& patch) {
  return noiseFloor(noise, rt::DepthModelParameters{}, patch, kStiffness_n_per_m);
}

/// A line of the table: JND of one frame, eight frames, and three of a moving surface.
struct TableEntry {
  double side_m;
  double distance_m;
  double one_jnd;
  double eight_jnd;
  double moving_jnd;
  double rounding_jnd;  ///< half of the last digit stated
};

void expectAsInTheTable(const TableEntry& entry, double share_below) {
  SCOPED_TRACE(std::to_string(entry.side_m) + " m at " + std::to_string(entry.distance_m) + " m");
  const auto jnd = [&entry](int frames, bool moving) {
    const FloorPatch patch{
        .side_m = entry.side_m, .distance_m = entry.distance_m, .frames = {frames, moving}};
    return floorOf(SensorNoise::harsh(), patch).force_jnd;
  };
  const auto expectNear = [&](double ours, double stated) {
    // what the sheet says, to its last digit, or as much above as is allowed
    EXPECT_GE(ours, stated - entry.rounding_jnd);
    EXPECT_LE(ours * (1 - share_below), stated + entry.rounding_jnd);
  };
  expectNear(jnd(1, false), entry.one_jnd);
  expectNear(jnd(8, false), entry.eight_jnd);
  expectNear(jnd(3, true), entry.moving_jnd);
}

TEST(NoiseFloor, IsTheFactSheetsForPatchesOfUpTo24Pixels) {
  const double tenth = 0.05 + 1e-9;
  const double whole = 0.5;
  for (const TableEntry& entry :
       {TableEntry{0.01, 1, 2.2, 2.0, 1.7, tenth}, TableEntry{0.02, 1, 1.4, 1.3, 1.1, tenth},
        TableEntry{0.04, 1, 0.9, 0.8, 0.7, tenth}, TableEntry{0.01, 2, 10.8, 9.9, 8.4, tenth},
        TableEntry{0.02, 2, 8.8, 8.1, 6.8, tenth}, TableEntry{0.04, 2, 5.6, 5.2, 4.4, tenth},
        TableEntry{0.08, 2, 3.5, 3.2, 2.7, tenth}, TableEntry{0.02, 3, 23, 21, 18, whole},
        TableEntry{0.04, 3, 17, 15, 13, whole}, TableEntry{0.08, 3, 10.6, 9.7, 8.3, 2 * tenth}}) {
    expectAsInTheTable(entry, 0);
  }
}

// Patches of 32 and 48 pixels: the sheet's figures are 2 to 9 % lower. The dense solution below, which shares
// nothing with ours but the covariance, confirms ours at 32 pixels.
TEST(NoiseFloor, IsAtMostNinePercentAboveTheFactSheetsForLargerPatches) {
  const double tenth = 0.05 + 1e-9;
  for (const TableEntry& entry :
       {TableEntry{0.08, 1, 0.4, 0.4, 0.35, tenth}, TableEntry{0.16, 2, 1.8, 1.6, 1.4, tenth},
        TableEntry{0.16, 3, 6.0, 5.5, 4.7, tenth}}) {
    expectAsInTheTable(entry, 0.09);
  }
}

/// x or y from -1 to 1 over a patch.
double placeOf(int pixel, int pixels) {
  return (2 * pixel + 1) / double(pixels) - 1;
}

double triangle(int distance, int window) {
  return std::max(0.0, 1 - std::abs(distance) / double(window));
}

/// Covariance of the coefficients of 1, x, y by the whole covariance matrix of all pixels of all frames of a
/// moving surface, where rounding is independent.
Eigen::MatrixXd denseCovariance(const drivers::NoisePatternParameters& noise, int pixels, int frames) {
  constexpr int coefficients = 3;
  const int count = pixels * pixels * frames;
  Eigen::MatrixXd covariance(count, count);
  Eigen::MatrixXd design(count, coefficients);
  for (int i = 0; i < count; ++i) {
    const int frame = i / (pixels * pixels);
    const int row = i / pixels % pixels;
    const int column = i % pixels;
    const double x = placeOf(column, pixels);
    const double y = placeOf(row, pixels);
    const double powers[] = {1, x, y};
    for (int k = 0; k < coefficients; ++k) design(i, k) = powers[k];
    for (int j = 0; j < count; ++j) {
      const int apart = std::abs(frame - j / (pixels * pixels));
      const double in_time =
          noise.static_raw * noise.static_raw * NoisePattern::staticCorrelation(noise, apart) +
          noise.drift_raw * noise.drift_raw * std::exp(-apart / noise.drift_frames) +
          (apart == 0 ? noise.fast_raw * noise.fast_raw : 0);
      const int down = row - j / pixels % pixels;
      const int right = column - j % pixels;
      covariance(i, j) = in_time * triangle(right, 9) * triangle(down, 9) +
                         noise.coarse_raw * noise.coarse_raw * triangle(right, 33) * triangle(down, 33) +
                         (i == j ? 1.0 / 12 : 0);
    }
  }
  return (design.transpose() * covariance.llt().solve(design)).inverse();
}

struct DenseCase {
  int pixels;
  int frames;
};

FloorPatch patchOf(const DenseCase& one) {
  // 594.2 px per metre at 1 m
  return {.side_m = one.pixels / 594.214342, .distance_m = 1, .frames = {one.frames, true}};
}

double denseDepth_m(const drivers::NoisePatternParameters& noise, const DenseCase& one) {
  return 0.003071102 * std::sqrt(denseCovariance(noise, one.pixels, one.frames)(0, 0));
}

TEST(NoiseFloor, IsThatOfADenseSolution) {
  drivers::NoisePatternParameters noise = SensorNoise::recorded().pattern;
  noise.coarse_raw = 0;
  for (const DenseCase& one : {DenseCase{5, 3}, DenseCase{12, 2}, DenseCase{32, 1}}) {
    const double depth_m = floorOf({.pattern = noise}, patchOf(one)).depth_m;
    EXPECT_NEAR(depth_m, denseDepth_m(noise, one), 1e-8 * depth_m) << one.pixels;
  }
}

TEST(NoiseFloor, TiltIsThatOfADenseSolution) {
  const auto noise = SensorNoise::harsh().pattern;
  const DenseCase one{10, 2};
  const double half_side_m = 0.5 * one.pixels / 594.214342;
  const double slope =
      0.003071102 * std::sqrt(denseCovariance(noise, one.pixels, one.frames)(1, 1)) / half_side_m;
  const FloorError floor = floorOf({.pattern = noise}, patchOf(one));
  EXPECT_NEAR(floor.slope, slope, 1e-8 * slope);
  EXPECT_NEAR(floor.tilt_force_n, 500 * 0.008 * slope, 1e-7 * slope);
}

TEST(NoiseFloor, OnTheEdgeOfAPatchIsThatOfADenseSolutionToo) {
  const auto noise = SensorNoise::harsh().pattern;
  const DenseCase one{10, 2};
  const Eigen::MatrixXd covariance = denseCovariance(noise, one.pixels, one.frames);
  const double expected_m =
      0.003071102 * std::sqrt(covariance(0, 0) + 2 * covariance(0, 1) + covariance(1, 1));
  FloorPatch patch = patchOf(one);
  patch.off_centre = 1;
  EXPECT_NEAR(floorOf({.pattern = noise}, patch).depth_m, expected_m, 1e-8 * expected_m);
}

// An estimate that knows nothing of the distortion cannot be better than one that does; that it is hardly
// worse shows that the floor is one.
TEST(NoiseFloor, WithDistortionIsLittleAboveTheBestThatKnowsIt) {
  const auto noise = SensorNoise::recorded().pattern;
  for (const DenseCase& one : {DenseCase{12, 2}, DenseCase{24, 1}}) {
    const double best_m = denseDepth_m(noise, one);
    const double depth_m = floorOf({.pattern = noise}, patchOf(one)).depth_m;
    EXPECT_GE(depth_m, best_m * (1 - 1e-9));
    EXPECT_LE(depth_m, best_m * 1.03);
  }
}

// "At 4 N and 80 mm 0.24 N RMS at 2 m, 0.66 N at 3 m": between one frame and the mean of eight.
TEST(NoiseFloor, ForceAlongTheSurfaceIsTheFactSheets) {
  const auto tilt = [](double distance_m, int frames) {
    return floorOf(SensorNoise::harsh(), {.side_m = 0.08, .distance_m = distance_m, .frames = {frames}})
        .tilt_force_n;
  };
  EXPECT_LT(tilt(2, 8), 0.24);
  EXPECT_GT(tilt(2, 1), 0.24);
  EXPECT_LT(tilt(3, 8), 0.66);
  EXPECT_GT(tilt(3, 1), 0.66);
}

TEST(NoiseFloor, IsUnknownWhereThePatchHasTooFewPixels) {
  const FloorError floor = floorOf(SensorNoise::harsh(), {.side_m = 0.01, .distance_m = 4});
  EXPECT_FALSE(floor.determined);
  EXPECT_TRUE(std::isinf(floor.force_jnd));
}

/// The noise that the sheet's figures of bodies are stated for.
SensorNoise::Parameters sheetsNoise() {
  SensorNoise::Parameters noise = SensorNoise::harsh();
  noise.pattern.fast_raw = 0.25;
  return noise;
}

FloorBody bodyAt(double distance_m, double diameter_m, bool rod) {
  FloorBody body{.contact_m = {0, 0, -distance_m}, .outward = {0, 0, 1}, .radius_m = diameter_m / 2};
  if (rod) body.axis = Vec3{1, 0, 0};
  return body;
}

double bodyFloor_jnd(const FloorBody& body) {
  return noiseFloor(sheetsNoise(), {}, body, kStiffness_n_per_m).force_jnd;
}

struct SheetsBody {
  double diameter_m;
  bool rod;
  std::vector<double> jnd;  ///< at 0.6, 1, 1.5 and 2 m
};

// The sheet says neither how far around the contact nor how near to the outline the pixels are that it uses;
// 160 mm, of a rod 80 mm, and 70 degrees are ours. With 60 or 80 degrees the floor of the ball of 50 mm is 18
// % higher or 12 % lower, with 60 or 100 mm of the rod of 20 mm 13 % higher or 9 % lower.
TEST(BodyFloor, IsTheFactSheetsWithinAQuarter) {
  constexpr double kDistances_m[] = {0.6, 1, 1.5, 2};
  for (const SheetsBody& sheet :
       {SheetsBody{0.05, false, {0.27, 0.90, 2.7, 5.8}}, SheetsBody{0.1, false, {0.14, 0.57, 1.59}},
        SheetsBody{0.02, true, {0.28, 0.95, 2.9, 6.5}}, SheetsBody{0.04, true, {0.15, 0.75, 1.88}},
        SheetsBody{0.08, true, {0.12, 0.49, 1.45}}}) {
    for (std::size_t i = 0; i < sheet.jnd.size(); ++i) {
      const double jnd = bodyFloor_jnd(bodyAt(kDistances_m[i], sheet.diameter_m, sheet.rod));
      EXPECT_NEAR(jnd, sheet.jnd[i], 0.25 * sheet.jnd[i])
          << (sheet.rod ? "rod " : "ball ") << sheet.diameter_m << " m at " << kDistances_m[i] << " m";
    }
  }
}

TEST(BodyFloor, FallsWithTheSizeOfTheBodyAndRisesWithItsDistance) {
  for (const bool rod : {false, true}) {
    double before = 0;
    for (const double distance_m : {0.6, 0.8, 1.0, 1.4, 2.0}) {
      const double jnd = bodyFloor_jnd(bodyAt(distance_m, 0.06, rod));
      EXPECT_GT(jnd, before) << distance_m;
      before = jnd;
    }
    before = std::numeric_limits<double>::infinity();
    for (const double diameter_m : {0.02, 0.03, 0.05, 0.08}) {
      const double jnd = bodyFloor_jnd(bodyAt(1, diameter_m, rod));
      EXPECT_LT(jnd, before) << diameter_m;
      before = jnd;
    }
  }
}

// A rod looks the same however it is turned about the optical axis, but for the pixels on its border: a
// rectangle of 47 by 33 pixels has up to 5 % more or fewer of them, and each unknown takes its share.
TEST(BodyFloor, OfARodHardlyDependsOnItsTurnInTheImage) {
  const double upright = bodyFloor_jnd(bodyAt(1, 0.06, true));
  for (const double turn_deg : {30.0, 60.0, 90.0}) {
    FloorBody turned = bodyAt(1, 0.06, true);
    const double turn = turn_deg * std::numbers::pi / 180;
    turned.axis = Vec3{std::cos(turn), std::sin(turn), 0};
    EXPECT_NEAR(bodyFloor_jnd(turned), upright, 0.1 * upright) << turn_deg;
  }
}

TEST(BodyFloor, IsUnknownWhereTheBodyHasTooFewPixels) {
  EXPECT_FALSE(noiseFloor(sheetsNoise(), {}, bodyAt(3.5, 0.01, false), kStiffness_n_per_m).determined);
}

/// A ball that is fitted to noisy disparities of one frame by Gauss-Newton with the covariance of all pixels.
class BallFit {
 public:
  BallFit(const Vec3& centre_m, double radius_m) {
    truth_ << centre_m.x, centre_m.y, centre_m.z, radius_m;
    const double near_outline = std::cos(FloorBody{}.max_incidence_rad);
    for (int row = 0; row < 480; ++row) {
      for (int column = 0; column < 640; ++column) {
        const Vec3 ray{(column - camera_.cx_px) / camera_.fx_px, -(row - camera_.cy_px) / camera_.fy_px, -1};
        const double depth_m = depthOn(ray, truth_);
        if (!(depth_m > 0)) continue;
        const Vec3 normal = (1 / radius_m) * (depth_m * ray - centre_m);
        if (-dot(normal, ray) < near_outline * norm(ray)) continue;
        pixels_.push_back({column, row, ray});
      }
    }
    const auto count = static_cast<Eigen::Index>(pixels_.size());
    Eigen::MatrixXd covariance(count, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      for (Eigen::Index j = 0; j < count; ++j) {
        const Pixel& a = pixels_[static_cast<std::size_t>(i)];
        const Pixel& b = pixels_[static_cast<std::size_t>(j)];
        covariance(i, j) = kVariance * triangle(a.column - b.column, 9) * triangle(a.row - b.row, 9) +
                           (i == j ? 1.0 / 12 : 0);
      }
    }
    covariance_.compute(covariance);
  }

  /// Deviation of the force along the optical axis from its truth, over many frames of noise.
  double deviationOfForce_n(int frames, std::mt19937& random) const {
    double squares = 0;
    for (int i = 0; i < frames; ++i) {
      const Eigen::Vector4d fitted = fit(measured(random));
      const Eigen::Vector4d error = fitted - truth_;
      squares += std::pow(kStiffness_n_per_m * (error[2] + error[3]), 2);
    }
    return std::sqrt(squares / frames);
  }

 private:
  static constexpr double kVariance = 0.5 * 0.5 + 0.25 * 0.25;
  struct Pixel {
    int column;
    int row;
    Vec3 ray;
  };

  static double depthOn(const Vec3& ray, const Eigen::Vector4d& ball) {
    const Vec3 centre{ball[0], ball[1], ball[2]};
    const double a = dot(ray, ray);
    const double b = dot(ray, centre);
    return (b - std::sqrt(b * b - a * (dot(centre, centre) - ball[3] * ball[3]))) / a;
  }
  Eigen::VectorXd disparities(const Eigen::Vector4d& ball) const {
    Eigen::VectorXd raw(static_cast<Eigen::Index>(pixels_.size()));
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      const double depth_m = depthOn(pixels_[i].ray, ball);
      raw[static_cast<Eigen::Index>(i)] = (1 / depth_m - camera_.b_per_m) / camera_.a_per_m;
    }
    return raw;
  }

  /// What a sensor makes of the ball: errors of cells, each pixel's the mean of the 9 x 9 around it, rounded.
  Eigen::VectorXd measured(std::mt19937& random) const {
    std::normal_distribution<double> normal(0, std::sqrt(kVariance));
    std::map<std::pair<int, int>, double> cells;
    Eigen::VectorXd raw = disparities(truth_);
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      double error = 0;
      for (int down = 0; down < 9; ++down) {
        for (int right = 0; right < 9; ++right) {
          const std::pair cell{pixels_[i].column + right, pixels_[i].row + down};
          const auto [found, is_new] = cells.try_emplace(cell, 0);
          if (is_new) found->second = normal(random);
          error += found->second / 9;
        }
      }
      auto& value = raw[static_cast<Eigen::Index>(i)];
      value = std::round(value + error);
    }
    return raw;
  }

  Eigen::Vector4d fit(const Eigen::VectorXd& measured) const {
    Eigen::Vector4d ball = truth_;
    constexpr int kSteps = 6;
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::VectorXd now = disparities(ball);
      Eigen::MatrixXd slope(now.size(), 4);
      for (int k = 0; k < 4; ++k) {
        constexpr double kStep_m = 1e-6;
        slope.col(k) = (disparities(ball + kStep_m * Eigen::Vector4d::Unit(k)) - now) / kStep_m;
      }
      const Eigen::MatrixXd weighted = covariance_.solve(slope);
      ball += (slope.transpose() * weighted).ldlt().solve(weighted.transpose() * (measured - now));
    }
    return ball;
  }

  rt::DepthModelParameters camera_;
  Eigen::Vector4d truth_;
  std::vector<Pixel> pixels_;
  Eigen::LLT<Eigen::MatrixXd> covariance_;
};

// 400 fits know their deviation to 1 / sqrt(800), 3.5 %; three times that is allowed.
TEST(BodyFloor, IsTheScatterOfFitsToSyntheticNoise) {
  constexpr int kFits = 400;
  FloorBody body = bodyAt(1, 0.05, false);
  body.frames.count = 1;
  const double floor_n = noiseFloor(sheetsNoise(), {}, body, kStiffness_n_per_m).force_n;
  std::mt19937 random(11);
  const BallFit fit({0, 0, -1.025}, 0.025);
  EXPECT_NEAR(fit.deviationOfForce_n(kFits, random), floor_n, 3 * floor_n / std::sqrt(2.0 * kFits));
}

}  // namespace
}  // namespace hapticd::tools
