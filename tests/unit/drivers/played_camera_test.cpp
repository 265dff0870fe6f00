// SPDX-License-Identifier: Apache-2.0
// The analytic scenes in front of the cameras that deliver depth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "config/settings/settings.h"
#include "drivers/camera/synthetic/analytic_scene.h"

namespace hapticd::drivers {
namespace {

using rt::Vec3;

// Depths are stored in single precision, up to 4 m.
constexpr double kSingle_m = 4 * 0x1p-24;

rt::DepthModelParameters modelOf(PlayedCamera played) {
  config::CameraSettings settings;
  settings.driver = "synthetic";
  settings.of<SyntheticSettings>().played = played;
  return settings.effectiveDepthModel();
}

SyntheticSettings settingsOf(SyntheticScene scene, SyntheticNoise noise, double tilt_rad = 0) {
  SyntheticSettings settings;
  settings.scene = scene;
  settings.noise = noise;
  settings.tilt_rad = tilt_rad;
  return settings;
}

class APlayedCamera : public testing::TestWithParam<PlayedCamera> {
 protected:
  std::uint16_t rawAt(int column, int row) const {
    return frame_->raw[row * rt::strideOf(model_.width_px) + column];
  }
  double depthAt_m(int column, int row) const { return model_.unit_m * rawAt(column, row); }
  Vec3 rayAt(int column, int row) const {
    return {(column - model_.cx_px) / model_.fx_px, (model_.cy_px - row) / model_.fy_px, -1};
  }
  template <typename Check>
  void forEachPixel(const Check& check) const {
    for (int row = 0; row < model_.height_px; ++row) {
      for (int column = 0; column < model_.width_px; ++column) check(column, row);
    }
  }

  const rt::DepthModelParameters model_ = modelOf(GetParam());
  const std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
};

TEST_P(APlayedCamera, SeesEverySceneToHalfADepthUnit) {
  for (const auto kind :
       {SyntheticScene::plane, SyntheticScene::sphere, SyntheticScene::moving_sphere, SyntheticScene::edge}) {
    AnalyticScene scene(settingsOf(kind, SyntheticNoise::off, 0.3), model_);
    scene.render(0.7, *frame_);
    double worst = 0;  // fraction of the bound
    int points = 0;
    int missed = 0;
    forEachPixel([&](int column, int row) {
      const double truth = scene.trueDepth(column, row, 0.7);
      missed += (truth > model_.near_m && truth < model_.far_m) != (rawAt(column, row) != 0);
      if (rawAt(column, row) == 0) return;
      ++points;
      const Vec3 ray = rayAt(column, row);
      const double bound = (0.5 * model_.unit_m + kSingle_m) * norm(ray);
      worst = std::max(worst, std::abs(scene.signedDistance(depthAt_m(column, row) * ray, 0.7)) / bound);
    });
    EXPECT_LE(worst, 1) << static_cast<int>(kind);
    EXPECT_GT(points, 3000) << static_cast<int>(kind);
    EXPECT_EQ(missed, 0) << static_cast<int>(kind);
  }
}

TEST_P(APlayedCamera, StatesItselfInEachFrame) {
  AnalyticScene scene(settingsOf(SyntheticScene::plane, SyntheticNoise::sensor), model_);
  std::ranges::fill(frame_->raw, std::uint16_t{1234});
  scene.render(0, *frame_);
  EXPECT_EQ(frame_->camera, model_);
  const int stride = rt::strideOf(model_.width_px);
  for (int row = 0; row < model_.height_px; ++row) {
    for (int column = model_.width_px; column < stride; ++column)
      ASSERT_EQ(frame_->raw[row * stride + column], model_.raw_no_measurement);
  }
}

TEST_P(APlayedCamera, DeliversNothingOutsideNearAndFarWhateverTheNoise) {
  for (const SyntheticNoise noise :
       {SyntheticNoise::off, SyntheticNoise::quantised, SyntheticNoise::sensor, SyntheticNoise::harsh}) {
    // from far above near_m to far below far_m within one image
    SyntheticSettings settings = settingsOf(SyntheticScene::plane, noise, 1.3);
    settings.distance_m = 0.6;
    AnalyticScene scene(settings, model_);
    scene.render(0.5, *frame_);
    int valid = 0;
    int outside = 0;
    int invented = 0;
    forEachPixel([&](int column, int row) {
      if (rawAt(column, row) == 0) return;
      ++valid;
      const double depth_m = depthAt_m(column, row);
      outside += !(depth_m >= model_.near_m - 1e-9 && depth_m <= model_.far_m + 1e-9);
      const double truth = scene.trueDepth(column, row, 0.5);
      invented += !(truth >= model_.near_m && truth <= model_.far_m);
    });
    EXPECT_EQ(outside, 0);
    EXPECT_EQ(invented, 0);
    EXPECT_GT(valid, 50'000);
    EXPECT_LT(valid, 300'000);
  }
}

TEST_P(APlayedCamera, RoundsRandomlyWithoutBias) {
  AnalyticScene scene(settingsOf(SyntheticScene::plane, SyntheticNoise::quantised, 0.3), model_);
  double sum = 0;
  double pixels = 0;
  constexpr int kFrames = 4;
  for (int i = 0; i < kFrames; ++i) {
    scene.render(i / 30.0, *frame_);
    forEachPixel([&](int column, int row) {
      const double difference = rawAt(column, row) - scene.trueDepth(column, row, 0) / model_.unit_m;
      ASSERT_LT(std::abs(difference), 1 + 2 * kSingle_m / model_.unit_m);
      sum += difference;
      pixels += 1;
    });
  }
  // five standard errors of differences of at most a unit, whose variance is at most 1/4
  EXPECT_NEAR(sum / pixels, 0, 5 * std::sqrt(0.25 / pixels));
}

TEST_P(APlayedCamera, ShowsTheSameForTheSameSeedAndTime) {
  SyntheticSettings settings = settingsOf(SyntheticScene::moving_sphere, SyntheticNoise::sensor);
  const auto imageOf = [&](double t_s) {
    AnalyticScene(settings, model_).render(t_s, *frame_);
    return std::vector<std::uint16_t>(frame_->image().begin(), frame_->image().end());
  };
  const auto image = imageOf(1.7);
  EXPECT_EQ(image, imageOf(1.7));
  EXPECT_NE(image, imageOf(2.7));
  settings.seed = 2;
  EXPECT_NE(image, imageOf(1.7));
}

INSTANTIATE_TEST_SUITE_P(Kinds, APlayedCamera,
                         testing::Values(PlayedCamera::stereo, PlayedCamera::time_of_flight),
                         [](const auto& kind) { return std::string(rt::wordOf(kind.param)); });

/// The row through the middle of a ball that is 0.6 m away and touches a wall.
class BallBeforeAWall : public testing::Test {
 protected:
  static constexpr double kWall_m = 0.75;
  struct Row {
    rt::DepthModelParameters model;
    std::vector<double> truth_m;
    std::vector<double> seen_m;  // 0: nothing
  };
  static Row rowOf(PlayedCamera played) {
    Row row{modelOf(played), {}, {}};
    SyntheticSettings settings = settingsOf(SyntheticScene::moving_sphere, SyntheticNoise::sensor);
    settings.sphere_radius_m = kWall_m - 0.6;
    settings.distance_m = 0.6;
    AnalyticScene scene(settings, row.model);
    const auto frame = std::make_unique<rt::DepthFrame>();
    scene.render(0, *frame);
    const int middle = row.model.height_px / 2;
    for (int column = 0; column < row.model.width_px; ++column) {
      row.truth_m.push_back(scene.trueDepth(column, middle, 0));
      row.seen_m.push_back(row.model.unit_m * frame->raw[middle * rt::strideOf(row.model.width_px) + column]);
    }
    return row;
  }
  /// First and last column of the ball.
  static std::pair<std::size_t, std::size_t> ballIn(const Row& row) {
    const auto is_ball = [](double depth_m) { return depth_m < kWall_m - 1e-6; };
    const auto first = std::ranges::find_if(row.truth_m, is_ball);
    const auto end = std::find_if_not(first, row.truth_m.end(), is_ball);
    return {static_cast<std::size_t>(first - row.truth_m.begin()),
            static_cast<std::size_t>(end - row.truth_m.begin()) - 1};
  }
};

TEST_F(BallBeforeAWall, IsBesideABandThatTheRightImagerDoesNotSee) {
  const Row row = rowOf(PlayedCamera::stereo);
  const auto [first, last] = ballIn(row);
  const double focal_baseline_px_m = row.model.fx_px * 0.05;
  // The wall is hidden by the points of the ball whose line of sight to the right imager touches it: their
  // column minus their disparity is the least.
  double limit = static_cast<double>(first);
  for (std::size_t column = first; column <= last; ++column)
    limit = std::min(limit, static_cast<double>(column) - focal_baseline_px_m / row.truth_m[column]);
  limit += focal_baseline_px_m / kWall_m;  // the column of the wall on that line
  ASSERT_LT(limit, static_cast<double>(first) - 4);
  for (std::size_t column = 30; column < first - 2; ++column) {
    if (std::abs(static_cast<double>(column) - limit) < 1)
      continue;  // the touching point is between two pixels
    EXPECT_EQ(row.seen_m[column] == 0, static_cast<double>(column) > limit) << column << " " << limit;
  }
  for (std::size_t column = last + 3; column < row.seen_m.size(); ++column) EXPECT_GT(row.seen_m[column], 0);
}

TEST_F(BallBeforeAWall, OfATimeOfFlightCameraHasNoBand) {
  const Row row = rowOf(PlayedCamera::time_of_flight);
  EXPECT_EQ(std::ranges::count(row.seen_m, 0.0), 0);
}

}  // namespace
}  // namespace hapticd::drivers
