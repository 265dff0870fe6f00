// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "drivers/camera/synthetic/synthetic_camera.h"
#include "drivers/driver_table.h"
#include "frame_collector.h"

namespace hapticd::drivers {
namespace {

using rt::Vec3;

// Disparities are computed in double and stored in single precision: 2^-14 of 1024..2047.
constexpr double kDisparityRounding = 0x1p-13;

struct View {
  SyntheticSettings settings;
  rt::DepthModelParameters model;  // Table I of the paper, 0.4..4 m
};

SyntheticSettings settingsOf(SyntheticScene scene, double distance_m = 1, double tilt_rad = 0) {
  SyntheticSettings settings;
  settings.scene = scene;
  settings.noise = SyntheticNoise::off;
  settings.distance_m = distance_m;
  settings.tilt_rad = tilt_rad;
  return settings;
}

Vec3 ray(const rt::DepthModelParameters& model, int column, int row) {
  return {(column - model.cx_px) / model.fx_px, -(row - model.cy_px) / model.fy_px, -1};
}

/// Expects that every valid pixel, back-projected by eq. (1)-(2), lies on the true surface within half a raw
/// unit. With e = 0.5 units, 1/Z' = 1/Z + |a| e for the true depth Z', so |Z - Z'| <= Z^2 |a| e / (1 - Z |a|
/// e); the point moves along its ray by that times the ray's length, and the distance changes by no more.
void expectPointsOnSurface(const View& view, double t_s, std::size_t min_points) {
  AnalyticScene scene(view.settings, view.model);
  const auto frame = std::make_unique<rt::DepthFrame>();
  scene.render(t_s, *frame);
  std::size_t points = 0;
  double worst = 0;  // fraction of the bound
  for (int row = 0; row < kKinectHeight; ++row) {
    for (int column = 0; column < kKinectWidth; ++column) {
      const std::uint16_t raw = frame->raw[row * kKinectWidth + column];
      if (raw == kKinectNoMeasurement) continue;
      const double depth = 1 / (view.model.a_per_m * raw + view.model.b_per_m);
      const Vec3 along = ray(view.model, column, row);
      const double shift = std::abs(view.model.a_per_m) * (0.5 + kDisparityRounding);
      const double bound = depth * depth * shift / (1 - depth * shift) * norm(along);
      worst = std::max(worst, std::abs(scene.signedDistance(depth * along, t_s)) / bound);
      ++points;
    }
  }
  EXPECT_LE(worst, 1.0);
  EXPECT_GE(points, min_points);
}

TEST(AnalyticScene, PointsLieOnTheSurfaceToHalfARawUnit) {
  View factory{settingsOf(SyntheticScene::moving_sphere, 0.9), {}};
  factory.model.a_per_m = -0.02605 / 9;
  factory.model.b_per_m = 28.379075 / 9;
  factory.model.fx_px = factory.model.fy_px = 575.8;
  const struct {
    View view;
    double t_s;
    std::size_t min_points;
  } cases[] = {{{settingsOf(SyntheticScene::plane), {}}, 0, kKinectPixels},
               {{settingsOf(SyntheticScene::plane, 2.5), {}}, 0, kKinectPixels},
               {{settingsOf(SyntheticScene::plane, 1.2, 0.7), {}}, 0, kKinectPixels},
               {{settingsOf(SyntheticScene::plane, 0.8, -1), {}}, 0, kKinectPixels / 2},
               {{settingsOf(SyntheticScene::sphere), {}}, 0, 5000},
               {{settingsOf(SyntheticScene::moving_sphere), {}}, 0, kKinectPixels},
               {{settingsOf(SyntheticScene::moving_sphere), {}}, 3, kKinectPixels},
               {{settingsOf(SyntheticScene::edge, 1, 0.3), {}}, 0, 300 * kKinectHeight},
               {factory, 0.4, kKinectPixels}};
  for (const auto& [view, t_s, min_points] : cases) expectPointsOnSurface(view, t_s, min_points);
}

TEST(AnalyticScene, EveryRayThatMeetsTheSphereSeesItAndNoOther) {
  const View view{settingsOf(SyntheticScene::sphere, 0.9), {}};
  AnalyticScene scene(view.settings, view.model);
  const auto frame = std::make_unique<rt::DepthFrame>();
  scene.render(0, *frame);
  int different = 0;
  for (int row = 0; row < kKinectHeight; ++row) {
    for (int column = 0; column < kKinectWidth; ++column) {
      // The angle between the ray and the centre (straight ahead), compared with the sphere's apparent
      // radius.
      const double angle = std::acos(1 / norm(ray(view.model, column, row)));
      const double limb = std::asin(view.settings.sphere_radius_m / view.settings.distance_m);
      if (std::abs(angle - limb) < 1e-9) continue;
      const bool seen = frame->raw[row * kKinectWidth + column] != kKinectNoMeasurement;
      different += seen != (angle < limb);
    }
  }
  EXPECT_EQ(different, 0);
}

TEST(AnalyticScene, SignedDistancesMatchTheGeometry) {
  const double tolerance = 1e-12;  // a few roundings of numbers near 1
  const AnalyticScene plane(settingsOf(SyntheticScene::plane, 1, std::numbers::pi / 6), {});
  EXPECT_NEAR(plane.signedDistance({0, 0, 0}, 0), std::sqrt(3) / 2, tolerance);
  EXPECT_NEAR(plane.signedDistance({0.3, 0, -1}, 0), 0, tolerance);
  EXPECT_NEAR(plane.signedDistance({0, 0.1, -1}, 0), -0.05, tolerance);  // the upper part is nearer

  const AnalyticScene sphere(settingsOf(SyntheticScene::sphere), {});
  EXPECT_NEAR(sphere.signedDistance({0, 0, -0.8}, 0), 0.1, tolerance);
  EXPECT_NEAR(sphere.signedDistance({0.03, 0.04, -1}, 0), -0.05, tolerance);

  const AnalyticScene moving(settingsOf(SyntheticScene::moving_sphere), {});
  EXPECT_NEAR(moving.signedDistance({0.1, 0, -0.8}, 1), 0.1, tolerance);  // a quarter of the period: x = 0.1
  EXPECT_NEAR(moving.signedDistance({-0.5, 0.3, -1.05}, 1), 0.05, tolerance);
  EXPECT_NEAR(moving.signedDistance({0.5, 0.3, -1.12}, 1), -0.02, tolerance);

  const AnalyticScene edge(settingsOf(SyntheticScene::edge), {});
  EXPECT_NEAR(edge.signedDistance({-0.2, 0, -0.9}, 0), 0.1, tolerance);
  EXPECT_NEAR(edge.signedDistance({0.03, 0, -0.96}, 0), 0.05, tolerance);
  EXPECT_NEAR(edge.signedDistance({0.03, 0, -1.5}, 0), 0.03, tolerance);
  EXPECT_NEAR(edge.signedDistance({-0.02, 0, -1.5}, 0), -0.02, tolerance);
}

TEST(AnalyticScene, TheEdgeHasNothingBesideIt) {
  AnalyticScene scene(settingsOf(SyntheticScene::edge), {});
  const auto frame = std::make_unique<rt::DepthFrame>();
  scene.render(0, *frame);
  const rt::DepthModelParameters model;
  int different = 0;
  for (std::size_t pixel = 0; pixel < kKinectPixels; ++pixel) {
    const bool left = static_cast<int>(pixel % kKinectWidth) <= model.cx_px;
    different += left != (frame->raw[pixel] != kKinectNoMeasurement);
  }
  EXPECT_EQ(different, 0);
}

TEST(AnalyticScene, NoNoiseMakesARawValueOutsideNearAndFar) {
  for (const SyntheticNoise noise :
       {SyntheticNoise::off, SyntheticNoise::quantised, SyntheticNoise::sensor, SyntheticNoise::harsh}) {
    // From far above near_m to far below far_m within one image.
    SyntheticSettings settings = settingsOf(SyntheticScene::plane, 0.6, 1.3);
    settings.noise = noise;
    const rt::DepthModelParameters model;
    AnalyticScene scene(settings, model);
    const auto frame = std::make_unique<rt::DepthFrame>();
    scene.render(0.5, *frame);
    int valid = 0;
    int outside = 0;
    int invented = 0;
    for (std::size_t pixel = 0; pixel < kKinectPixels; ++pixel) {
      const std::uint16_t raw = frame->raw[pixel];
      if (raw == kKinectNoMeasurement) continue;
      ++valid;
      const double depth = 1 / (model.a_per_m * raw + model.b_per_m);
      outside += !(depth >= model.near_m && depth <= model.far_m);
      const double truth = scene.trueDepth(static_cast<int>(pixel % kKinectWidth),
                                           static_cast<int>(pixel / kKinectWidth), 0.5);
      invented += !(truth >= model.near_m && truth <= model.far_m);
    }
    EXPECT_EQ(outside, 0);
    EXPECT_EQ(invented, 0);
    EXPECT_GT(valid, 50'000);
    EXPECT_LT(valid, 300'000);
  }
}

TEST(AnalyticScene, RendersTheSameImageForTheSameSeedAndTime) {
  SyntheticSettings settings = settingsOf(SyntheticScene::moving_sphere);
  settings.noise = SyntheticNoise::sensor;
  AnalyticScene first(settings, {});
  AnalyticScene second(settings, {});
  settings.seed = 2;
  AnalyticScene other(settings, {});
  const auto a = std::make_unique<rt::DepthFrame>();
  const auto b = std::make_unique<rt::DepthFrame>();
  first.render(0.1, *b);
  first.render(1.7, *a);
  second.render(1.7, *b);
  EXPECT_TRUE(std::ranges::equal(a->image(), b->image()));
  other.render(1.7, *b);
  EXPECT_FALSE(std::ranges::equal(a->image(), b->image()));
}

TEST(SyntheticCamera, FilmsTheSceneAtTheTimeOfItsTicks) {
  SyntheticSettings settings;
  settings.frame_rate_hz = 20;
  test::FrameCollector frames;
  SyntheticCamera camera(settings, {});
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(4));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  camera.stop();

  AnalyticScene scene(settings, {});
  const auto expected = std::make_unique<rt::DepthFrame>();
  for (std::size_t index = 0; index < 4; ++index) {
    const rt::DepthFrame& frame = frames.frame(index);
    EXPECT_EQ(frame.sequence, index + 1);
    EXPECT_EQ(frame.device_ticks % 3'000'000, 0U) << "whole periods of 1/20 s at 60 MHz";
    scene.render(frame.device_ticks / 60e6, *expected);
    EXPECT_TRUE(std::ranges::equal(frame.image(), expected->image())) << index;
  }
}

TEST(SyntheticCamera, DoesNotStartWithoutAFrameRate) {
  SyntheticSettings settings;
  settings.frame_rate_hz = 0;
  test::FrameCollector frames;
  SyntheticCamera camera(settings, {});
  EXPECT_FALSE(camera.start(frames));
}

TEST(MakeCamera, MakesTheDriverThatTheSettingsName) {
  config::CameraSettings settings;
  settings.driver = "synthetic";
  EXPECT_NE(dynamic_cast<SyntheticCamera*>(makeCamera(settings).get()), nullptr);
  settings.driver = "freenect";
  EXPECT_EQ(makeCamera(settings)->status().identity, "freenect");
  settings.driver = "recorded";
  settings.of<RecordedSettings>().recording = "/nowhere";
  test::FrameCollector frames;
  const auto started = makeCamera(settings)->start(frames);
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().text().find("/nowhere"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::drivers
