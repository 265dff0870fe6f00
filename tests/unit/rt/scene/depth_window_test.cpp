// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_model.h"
#include "tools/lib/oracle/reference_camera.h"

namespace hapticd::rt {
namespace {

using tools::ReferenceCamera;

struct Ball {
  Vec3 centre;
  double radius;
};

class Randomness {
 public:
  explicit Randomness(std::uint32_t seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  int below(int count) { return std::uniform_int_distribution(0, count - 1)(engine_); }

 private:
  std::mt19937 engine_;
};

PoseParameters randomPose(Randomness& random) {
  const auto turn = [&random] { return random.between(-3.1, 3.1); };
  const auto shift = [&random] { return random.between(-2, 2); };
  return {{shift(), shift(), shift()}, turn(), turn(), turn()};
}

/// Returns a random ball: in view, across the image borders, beside the view, around or behind the camera.
Ball randomBall(Randomness& random, const DepthModelParameters& parameters, const ReferenceCamera& camera) {
  const double radius = random.between(0.005, 0.4);
  switch (random.below(3)) {
    case 0:  // around the camera
      return {
          camera.toWorld({random.between(-0.5, 0.5), random.between(-0.5, 0.5), random.between(-0.8, 0.8)}),
          radius};
    case 1:  // around a ray that meets the image or passes near it
      return {
          camera.toWorld(random.between(0.3, 4.3) * Vec3{random.between(-400, 400) / parameters.fx_px,
                                                         random.between(-300, 300) / parameters.fy_px, -1}),
          radius};
    default:
      return {camera.toWorld({random.between(-2, 2), random.between(-2, 2), random.between(-4.5, 0.5)}),
              radius};
  }
}

/// For a ball, the points of all raw values on a sparse lattice of pixels with a random start, and of all
/// pixels just outside the window: those in the ball must be in the window.
class WindowCheck {
 public:
  WindowCheck(const DepthModelParameters& parameters, const PoseParameters& pose)
      : camera_(parameters, pose), model_(std::make_unique<DepthModel>(parameters, pose)) {
    for (std::uint32_t raw = 0; raw < drivers::kKinectRawValues; ++raw) {
      if (!camera_.accepts(raw)) continue;
      raws_.push_back(raw);
      depths_.push_back(1 / (parameters.a_per_m * raw + parameters.b_per_m));
    }
    origin_ = camera_.toWorld({});
    across_ = 1 / parameters.fx_px * (camera_.toWorld({1, 0, 0}) - origin_);
    up_ = 1 / parameters.fy_px * (camera_.toWorld({0, 1, 0}) - origin_);
    first_ray_ = camera_.toWorld({0, 0, -1}) - origin_ - parameters.cx_px * across_ + parameters.cy_px * up_;
  }

  void check(const Ball& ball, Randomness& random) {
    const PixelWindow window = model_->windowOfBall(ball.centre, ball.radius);
    constexpr int kStep = 37;
    for (int v = random.below(kStep); v < drivers::kKinectHeight; v += kStep) {
      for (int u = random.below(kStep); u < drivers::kKinectWidth; u += kStep) checkPixel(ball, window, u, v);
    }
    if (window.empty()) return;
    for (int u = 0; u < drivers::kKinectWidth; u += 3) {
      checkPixel(ball, window, u, window.row_first - 1);
      checkPixel(ball, window, u, window.row_last + 1);
    }
    for (int v = 0; v < drivers::kKinectHeight; v += 3) {
      checkPixel(ball, window, window.column_first - 1, v);
      checkPixel(ball, window, window.column_last + 1, v);
    }
  }

  const ReferenceCamera& camera() const { return camera_; }
  std::uint64_t pointsInBalls() const { return points_in_balls_; }

 private:
  void checkPixel(const Ball& ball, const PixelWindow& window, int u, int v) {
    if (u < 0 || u >= drivers::kKinectWidth || v < 0 || v >= drivers::kKinectHeight) return;
    const Vec3 ray = first_ray_ + u * across_ - v * up_;
    const Vec3 to_camera = origin_ - ball.centre;
    const bool pixel_inside =
        u >= window.column_first && u <= window.column_last && v >= window.row_first && v <= window.row_last;
    for (std::size_t i = 0; i < depths_.size(); ++i) {
      const Vec3 d = to_camera + depths_[i] * ray;
      if (dot(d, d) > ball.radius * ball.radius) continue;
      ++points_in_balls_;
      ASSERT_TRUE(pixel_inside && raws_[i] >= window.raw_first && raws_[i] <= window.raw_last)
          << "pixel " << u << ' ' << v << " raw " << raws_[i] << " ball " << ball.centre.x << ' '
          << ball.centre.y << ' ' << ball.centre.z << " radius " << ball.radius;
    }
  }

  ReferenceCamera camera_;
  std::unique_ptr<DepthModel> model_;
  std::vector<std::uint32_t> raws_;
  std::vector<double> depths_;
  Vec3 origin_, across_, up_, first_ray_;  // in world; pixel (u, v) looks along first_ray + u across - v up
  std::uint64_t points_in_balls_ = 0;
};

TEST(DepthWindow, HoldsEveryPixelAndRawValueThatCanShowAPointOfTheBall) {
  Randomness random(1);
  std::uint64_t points = 0;
  for (int camera = 0; camera < 20; ++camera) {
    DepthModelParameters parameters;
    if (camera % 4 == 3) {  // depth falls with the raw value
      parameters.a_per_m = 0.002;
      parameters.b_per_m = -1;
    }
    WindowCheck check(parameters, randomPose(random));
    for (int i = 0; i < 25; ++i) {
      check.check(randomBall(random, parameters, check.camera()), random);
      if (HasFatalFailure()) return;
    }
    points += check.pointsInBalls();
  }
  EXPECT_GT(points, 1'000'000U);  // not all balls were out of view
}

TEST(DepthWindow, IsEmptyForABallThatTheCameraCannotSee) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  EXPECT_TRUE(model->windowOfBall({0, 0, 0.2}, 0.1).empty()) << "behind the camera";
  EXPECT_TRUE(model->windowOfBall({0, 0, -0.2}, 0.1).empty()) << "nearer than the near limit";
  EXPECT_TRUE(model->windowOfBall({0, 0, -4.2}, 0.1).empty()) << "farther than the far limit";
  EXPECT_TRUE(model->windowOfBall({2, 0, -1}, 0.1).empty()) << "right of the view";
  EXPECT_TRUE(model->windowOfBall({-2, 0, -1}, 0.1).empty()) << "left of the view";
  EXPECT_TRUE(model->windowOfBall({0, 2, -1}, 0.1).empty()) << "above the view";
  EXPECT_TRUE(model->windowOfBall({0, -2, -1}, 0.1).empty()) << "below the view";
}

TEST(DepthWindow, IsTheWholeImageForABallAroundTheCamera) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const PixelWindow window = model->windowOfBall({0.1, 0, 0}, 1);
  EXPECT_EQ(window.column_first, 0);
  EXPECT_EQ(window.column_last, 639);
  EXPECT_EQ(window.row_first, 0);
  EXPECT_EQ(window.row_last, 479);
}

/// Determines the first and last column and row whose rays meet the ball by trying all pixels.
PixelWindow pixelsThatMeet(const Ball& ball, const DepthModelParameters& m) {
  PixelWindow met{drivers::kKinectWidth, -1, drivers::kKinectHeight, -1, 0, 0};
  for (int v = 0; v < drivers::kKinectHeight; ++v) {
    for (int u = 0; u < drivers::kKinectWidth; ++u) {
      const Vec3 ray{(u - m.cx_px) / m.fx_px, (m.cy_px - v) / m.fy_px, -1};
      const Vec3 nearest = dot(ray, ball.centre) / dot(ray, ray) * ray - ball.centre;
      if (norm(nearest) > ball.radius) continue;
      met.column_first = std::min(met.column_first, u);
      met.column_last = std::max(met.column_last, u);
      met.row_first = std::min(met.row_first, v);
      met.row_last = std::max(met.row_last, v);
    }
  }
  return met;
}

TEST(DepthWindow, IsAtMostThreePixelsAndTwoRawValuesTooWideOnEachSide) {
  const DepthModelParameters parameters;
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  Randomness random(2);
  for (int i = 0; i < 40; ++i) {
    const Ball ball{
        random.between(0.6, 3.5) * Vec3{random.between(-0.35, 0.35), random.between(-0.25, 0.25), -1},
        random.between(0.03, 0.15)};
    const PixelWindow window = model->windowOfBall(ball.centre, ball.radius);
    const PixelWindow met = pixelsThatMeet(ball, parameters);
    // A ball's outline touches its extreme columns and rows at one point, which falls between pixels: at most
    // one pixel more than the lattice shows; the window itself is widened by one and rounded outwards.
    EXPECT_GE(window.column_first, met.column_first - 3);
    EXPECT_LE(window.column_last, met.column_last + 3);
    EXPECT_GE(window.row_first, met.row_first - 3);
    EXPECT_LE(window.row_last, met.row_last + 3);
    const auto rawAt = [&](double z) { return (1 / z - parameters.b_per_m) / parameters.a_per_m; };
    EXPECT_GE(window.raw_first, rawAt(-ball.centre.z - ball.radius) - 2);
    EXPECT_LE(window.raw_last, rawAt(-ball.centre.z + ball.radius) + 2);
  }
}

}  // namespace
}  // namespace hapticd::rt
