// SPDX-License-Identifier: Apache-2.0
#include "rt/scene/visible_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "drivers/camera/kinect_image.h"
#include "rt/modelling/surface/surface_builder.h"
#include "rt/scene/scene.h"

namespace hapticd {
namespace {

using rt::SurfaceView;
using rt::Vec3;

/// A surface given by its inverse depth on the ray (x, y, -1), and the visible surface of its image. The
/// camera's raw unit is 0.1 mm at 1 m, so that rounding is negligible.
class Built {
 public:
  explicit Built(const std::function<double(double, double)>& inverse_depth)
      : model_(camera(), {}),
        builder_(model_),
        storage_({1, 1, 1, 1}, 1, model_),
        frame_(std::make_unique<rt::DepthFrame>()) {
    storage_.attachTo(scene_);
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        const rt::DepthModelParameters& c = model_.parameters();
        const double w = inverse_depth((column - c.cx_px) / c.fx_px, -(row - c.cy_px) / c.fy_px);
        const double raw = (w - c.b_per_m) / c.a_per_m;
        frame_->raw[row * drivers::kKinectWidth + column] = w > 0 && raw >= 0 && raw < 2046
                                                                ? static_cast<std::uint16_t>(std::lround(raw))
                                                                : drivers::kKinectNoMeasurement;
      }
    }
  }

  static rt::DepthModelParameters camera() {
    rt::DepthModelParameters model;
    model.a_per_m = -0.0002;
    model.b_per_m = 1.2;
    model.near_m = 0.84;
    model.far_m = 1.25;
    return model;
  }

  void build(const Vec3& centre, const rt::SurfaceParameters& parameters = {}) {
    ++frame_->sequence;
    frame_->arrival_ns += 33'333'333;
    again(centre, parameters);
  }
  void again(const Vec3& centre, const rt::SurfaceParameters& parameters = {}) {
    builder_.build(*frame_, nullptr, centre, 0.06, parameters, scene_.surface);
  }
  void shift(int raw) {
    for (std::uint16_t& value : frame_->image()) {
      if (value < drivers::kKinectNoMeasurement) value = static_cast<std::uint16_t>(value + raw);
    }
  }
  void punch(int row, int column, int edge) {
    for (int r = row; r < row + edge; ++r) {
      for (int c = column; c < column + edge; ++c)
        frame_->raw[r * drivers::kKinectWidth + c] = drivers::kKinectNoMeasurement;
    }
  }

  SurfaceView view(double age_s = 0) const { return {scene_.surface, model_, 0.035, age_s}; }

 private:
  rt::DepthModel model_;
  rt::SurfaceBuilder builder_;
  rt::SceneStorage storage_;
  rt::Scene scene_;
  std::unique_ptr<rt::DepthFrame> frame_;
};

/// Half a raw unit of rounding at 1 m.
constexpr double kRounding_m = 1e-4;

double degrees(double value) {
  return value * std::numbers::pi / 180;
}

TEST(VisibleSurface, GivesTheDistanceFromTiltedPlanes) {
  for (const double tilt : {0.0, 30.0, 60.0}) {
    const Vec3 normal{0, -std::sin(degrees(tilt)), std::cos(degrees(tilt))};
    Built plane([&](double x, double y) { return -dot(normal, Vec3{x, y, -1}) / normal.z; });
    plane.build({0, 0, -1});
    for (double across = -0.02; across <= 0.02; across += 0.0073) {
      for (double along = -0.02; along <= 0.02; along += 0.0061) {
        const Vec3 p = Vec3{across, along, -1 + 0.4 * across};
        const double expected = dot(normal, p - Vec3{0, 0, -1});
        const SurfaceView::Place place = plane.view().sample(p);
        ASSERT_TRUE(place.sheet.exists);
        EXPECT_NEAR(place.distance_m, expected, kRounding_m) << tilt;
        EXPECT_LE(norm(place.sheet.normal_in_camera - normal), 0.01) << tilt;
      }
    }
  }
}

TEST(VisibleSurface, GivesTheDistanceFromASphere) {
  constexpr double kRadius_m = 0.05;
  const Vec3 centre{0, 0, -1.05};
  Built sphere([&](double x, double y) {
    const Vec3 ray{x, y, -1};
    const double b = dot(ray, centre);
    const double root = b * b - dot(ray, ray) * (dot(centre, centre) - kRadius_m * kRadius_m);
    return root > 0 ? dot(ray, ray) / (b - std::sqrt(root)) : 0;
  });
  sphere.build({0, 0, -1});
  double squares = 0;
  int places = 0;
  for (double angle = 0; angle < 6.2; angle += 0.7) {
    for (const double polar : {0.1, 0.3, 0.5}) {
      const Vec3 normal{std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                        std::cos(polar)};
      const SurfaceView::Place place = sphere.view().sample(centre + kRadius_m * normal);
      ASSERT_TRUE(place.sheet.exists);
      squares += place.distance_m * place.distance_m;
      ++places;
      EXPECT_LE(norm(place.sheet.normal_in_camera - normal), 0.07) << angle << " " << polar;
    }
  }
  // the just noticeable difference at 4 N is 0.28 N, at 500 N/m
  EXPECT_LE(std::sqrt(squares / places), 0.56e-3);
}

TEST(VisibleSurface, EndsWhereTheImageOfTheBodyEnds) {
  Built wall([](double x, double) { return x < 0.0205 ? 1.0 : 0.0; });
  wall.build({0, 0, -1});
  const double pitch_m = 1 / Built::camera().fx_px;
  for (double y = -0.03; y < 0.03; y += 0.0017) {
    EXPECT_EQ(wall.view().sample({0.0205 - pitch_m, y, -1.01}).where, SurfaceView::Where::inside);
    EXPECT_EQ(wall.view().sample({0.0205 + pitch_m, y, -1.01}).where, SurfaceView::Where::free);
  }
}

TEST(VisibleSurface, ClosesHolesInASurface) {
  Built wall([](double, double) { return 1.0; });
  wall.punch(235, 330, 15);  // 2.5 cm
  wall.build({0, 0, -1});
  EXPECT_NEAR(wall.view().sample({0, 0, -1.01}).distance_m, -0.01, kRounding_m);
}

TEST(VisibleSurface, IsSolidOnlyWithinTheShell) {
  Built wall([](double, double) { return 1.0; });
  wall.build({0, 0, -1});
  EXPECT_EQ(wall.view().sample({0, 0, -1.034}).where, SurfaceView::Where::inside);
  EXPECT_EQ(wall.view().sample({0, 0, -1.036}).where, SurfaceView::Where::unseen);
  EXPECT_EQ(wall.view().sample({0, 0, -0.9}).where, SurfaceView::Where::free);
}

TEST(VisibleSurface, OfASceneAtRestIsAveragedOverFrames) {
  Built wall([](double, double) { return 1.0; });
  const rt::SurfaceParameters parameters{.fusion_frames = 4};
  wall.build({0, 0, -1}, parameters);
  wall.shift(1);
  wall.build({0, 0, -1}, parameters);
  const double half_m = 0.5 * 0.0002;
  EXPECT_NEAR(wall.view().sample({0, 0, -1}).distance_m, half_m, half_m / 2);
  wall.again({0.01, 0, -1}, parameters);  // another place in the same frame does not count twice
  EXPECT_NEAR(wall.view().sample({0, 0, -1}).distance_m, half_m, half_m / 2);
}

TEST(VisibleSurface, ContinuesToMoveBetweenFrames) {
  Built wall([](double, double) { return 1.0; });
  for (int frame = 0; frame < 6; ++frame) {
    wall.shift(-20);  // 4 mm towards the camera
    wall.build({0, 0, -1 + 0.004 * (frame + 1)});
  }
  const double now_m = wall.view().sample({0, 0, -0.97}).distance_m;
  const double later_m = wall.view(1.0 / 60).sample({0, 0, -0.97}).distance_m;
  EXPECT_NEAR(now_m, 1 / 1.024 - 0.97, 5e-4);
  EXPECT_NEAR(later_m - now_m, -0.002, 3e-4);
}

TEST(VisibleSurfaceView, GivesTheSpeedOfTheSurfaceAlongItsNormal) {
  const double tilt = 0.5;
  Built built([tilt](double x, double) { return 1.0 - tilt * x; });
  constexpr int kPerFrame_raw = -10;
  const double approach = 10 * 0.0002 * 30;  // of 1/Z, per metre and second
  const Vec3 centre{0.01, 0.01, -1.0};
  for (int frame = 0; frame < 12; ++frame) {
    built.build(centre);
    built.shift(kPerFrame_raw);
  }
  const Vec3 p{0.01, 0.01, -0.98};
  constexpr double kLater_s = 0.001;
  const rt::SurfaceView now = built.view(0);
  const rt::SurfaceView later = built.view(kLater_s);
  const double moved_m = now.sample(p).distance_m - later.sample(p).distance_m;
  const double speed = now.sample(p).sheet.speed_m_per_s;
  EXPECT_NEAR(speed, moved_m / kLater_s, 0.002);
  EXPECT_NEAR(speed, approach * std::cos(std::atan(tilt)), 0.05 * approach);
}

}  // namespace
}  // namespace hapticd
