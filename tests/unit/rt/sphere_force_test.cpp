// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <tuple>

#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/fixtures/closed_forms.h"
#include "tests/unit/rt/scene/made_up_scene.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using test::FramePointer;

constexpr double k = 500;
constexpr double D = 0.04;
constexpr double R = 0.05;
constexpr double kDiscRadius_m = 0.00976;  // a_N of the tabulated closed forms
constexpr int kNearest = 800;
constexpr double kCentreDepth_m = 2;
constexpr double kPixelPitch_m = 0.175e-3;  // at the sphere's centre
constexpr int kOutside = +1;
constexpr int kInside = -1;

/// Points spread evenly over a sphere on the optical axis: a spiral about the axis in which the rings between
/// consecutive points have equal areas, so that the number of points within any distance of the axis is
/// exact. Each point is represented by the nearest pixel, at the depth where that pixel's ray meets the
/// sphere. Outside, the camera looks at the near side; inside, into the bowl of the far side.
class SpiralSphere {
 public:
  explicit SpiralSphere(int side)
      : side_(side), parameters_(intrinsics(side)), memory_(drivers::kKinectPixels) {
    for (double& depth : depth_m_) depth = 0;
    // a_N^2 = N / (pi rho)
    const double points_on_sphere = kNearest * 4 * R * R / (kDiscRadius_m * kDiscRadius_m);
    const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
    for (int i = 0;; ++i) {
      const double cosine = 1 - (2 * i + 1) / points_on_sphere;
      const double from_axis = R * std::sqrt(1 - cosine * cosine);
      if (from_axis > 0.041) break;  // farther than D from every HIP on the axis
      see(from_axis * std::cos(i * golden_angle), from_axis * std::sin(i * golden_angle),
          kCentreDepth_m - side * R * cosine);
    }
    model_ = std::make_unique<DepthModel>(parameters_, PoseParameters{});
    GridParameters grid;
    grid.extent = ModelExtent::frame;
    grid.frame_voxel_edge_m = 0.01;
    built_ = std::make_unique<BuiltScene>(*model_, grid);
    built_->build(*test::frameOfDepth(parameters_, [this](int u, int v) { return depthAt(u, v); }));
  }

  /// Returns the force at the height h above the wall, positive outwards from it: away from the centre
  /// outside, towards it inside, which is towards the camera in both cases.
  ForceSample force(double h, const SpringParameters& parameters) {
    const double wall_m = kCentreDepth_m - side_ * R;
    return nearestSprings(built_->scene, {0, 0, h - wall_m}, parameters, memory_);
  }

  int pointsThatShareAPixel() const { return shared_; }

 private:
  /// 2046 raw steps over 30 mm of depth: 15 um, a tenth of the pixel pitch.
  static DepthModelParameters intrinsics(int side) {
    DepthModelParameters m;
    m.fx_px = m.fy_px = kCentreDepth_m / kPixelPitch_m;
    m.cx_px = 319.5;
    m.cy_px = 239.5;
    const double wall_m = kCentreDepth_m - side * R;
    const double other_m = wall_m + side * 0.029;
    test::spreadRawValuesOver(std::min(wall_m, other_m) - 0.0005, std::max(wall_m, other_m) + 0.0005, m);
    return m;
  }
  double& depthAt(int u, int v) { return depth_m_[static_cast<std::size_t>(v * drivers::kKinectWidth + u)]; }

  void see(double x, double y, double depth_m) {
    const auto u = static_cast<int>(std::lround(parameters_.cx_px + parameters_.fx_px * x / depth_m));
    const auto v = static_cast<int>(std::lround(parameters_.cy_px - parameters_.fy_px * y / depth_m));
    if (u < 0 || u >= drivers::kKinectWidth || v < 0 || v >= drivers::kKinectHeight) return;
    shared_ += depthAt(u, v) != 0 ? 1 : 0;
    const double slope_x = (u - parameters_.cx_px) / parameters_.fx_px;
    const double slope_y = (v - parameters_.cy_px) / parameters_.fy_px;
    const double length2 = 1 + slope_x * slope_x + slope_y * slope_y;
    const double root =
        std::sqrt(kCentreDepth_m * kCentreDepth_m - length2 * (kCentreDepth_m * kCentreDepth_m - R * R));
    depthAt(u, v) = (kCentreDepth_m - side_ * root) / length2;
  }

  int side_;
  int shared_ = 0;
  DepthModelParameters parameters_;
  std::array<double, drivers::kKinectPixels> depth_m_;
  std::unique_ptr<DepthModel> model_;
  std::unique_ptr<BuiltScene> built_;
  SearchMemory memory_;
};

/// Returns how far the mean of N springs may deviate from the closed form, in newtons. Each point was moved
/// to a pixel: up to half a pitch p on two axes, p / sqrt(6) root mean square, more by 1/cos(tilt) <= 1.5
/// along the surface. A spring's force changes by at most k D / s times that; s^2 = r^2 + h^2 averaged over
/// the disc of radius a gives (k D)^2 / a^2 * ln(1 + a^2/h^2), where h is at least the spacing of the points.
/// The moves are independent, so the mean of N has 1/sqrt(N) of it; four standard deviations are allowed. One
/// point more or fewer at the border contributes k D / N.
double snappingTolerance_n(double h, double disc_m, double points) {
  const double spacing = kDiscRadius_m * std::sqrt(std::numbers::pi / kNearest);
  const double nearest = std::max(h, spacing / 2);
  const double slope = k * D / disc_m * std::sqrt(std::log(1 + disc_m * disc_m / (nearest * nearest)));
  const double move = 1.5 * kPixelPitch_m / std::sqrt(6.0);
  return 4 * move * slope / std::sqrt(points) + k * D / points;
}

struct Row {
  double h_mm;
  double force_n;
};

void expectForceOfAll(int side, std::initializer_list<Row> rows) {
  const auto sphere = std::make_unique<SpiralSphere>(side);
  ASSERT_EQ(sphere->pointsThatShareAPixel(), 0);
  for (const Row& row : rows) {
    const double h = row.h_mm / 1000;
    const ForceSample sample = sphere->force(h, {k, D, 1, drivers::kKinectPixels});
    const double tolerance = snappingTolerance_n(h, std::sqrt(D * D - h * h), sample.points_used) + 0.5e-4;
    EXPECT_NEAR(sample.force_n_in_world.z, row.force_n, tolerance) << row.h_mm << " mm";
    EXPECT_NEAR(sample.force_n_in_world.z, test::sphereForceOfAll(k, D, R, side, h), tolerance);
    EXPECT_NEAR(sample.force_n_in_world.x, 0, tolerance);
    EXPECT_NEAR(sample.force_n_in_world.y, 0, tolerance);
  }
}

void expectForceOfNearest(int side, std::initializer_list<Row> rows) {
  const auto sphere = std::make_unique<SpiralSphere>(side);
  for (const Row& row : rows) {
    const double h = row.h_mm / 1000;
    const ForceSample sample = sphere->force(h, {k, D, 10, kNearest});
    EXPECT_EQ(sample.points_used, static_cast<std::uint32_t>(kNearest));
    EXPECT_NEAR(sample.force_n_in_world.z, row.force_n, snappingTolerance_n(h, kDiscRadius_m, kNearest))
        << row.h_mm << " mm";
    EXPECT_NEAR(sample.force_n_in_world.z, test::sphereForceOfNearest(k, D, R, kDiscRadius_m, side, h),
                snappingTolerance_n(h, kDiscRadius_m, kNearest));
  }
}

TEST(SphereForce, OutsideIsTheClosedFormOfAllPoints) {
  expectForceOfAll(
      kOutside,
      {{0, 1.3333}, {1, 1.7789}, {2, 2.1720}, {5, 3.0787}, {10, 3.8750}, {20, 3.7302}, {35, 1.1904}});
}

TEST(SphereForce, InsideIsTheClosedFormOfAllPoints) {
  expectForceOfAll(
      kInside,
      {{0, -1.3333}, {1, -0.8808}, {2, -0.4681}, {5, 0.5581}, {10, 1.6875}, {20, 2.4074}, {35, 1.0324}});
}

TEST(SphereForce, OutsideIsTheClosedFormOfTheNNearest) {
  expectForceOfNearest(kOutside, {{0.5, 2.7398}, {1, 4.2002}, {2, 6.5624}, {4, 9.5791}, {10, 11.7209}});
}

TEST(SphereForce, InsideIsTheClosedFormOfTheNNearest) {
  expectForceOfNearest(kInside, {{0.5, 0.6414}, {1, 2.1757}, {2, 4.7730}, {4, 8.3734}, {10, 11.6445}});
}

TEST(SphereForce, AttractsTheHandOnAConcaveWall) {
  // F_N(0) = -k a_N (D/3 - a_N/4) / R = -1.06 N
  expectForceOfNearest(kInside, {{1e-6, -1.0632}});
  const auto bowl = std::make_unique<SpiralSphere>(kInside);
  // attracting up to 0.31 mm where the N nearest count, up to 3.26 mm where all do
  EXPECT_LT(bowl->force(0.0002, {k, D, 10, kNearest}).force_n_in_world.z, 0);
  EXPECT_GT(bowl->force(0.0004, {k, D, 10, kNearest}).force_n_in_world.z, 0);
  EXPECT_LT(bowl->force(0.0030, {k, D, 10, drivers::kKinectPixels}).force_n_in_world.z, 0);
  EXPECT_GT(bowl->force(0.0035, {k, D, 10, drivers::kKinectPixels}).force_n_in_world.z, 0);
}

TEST(SphereForce, RepelsTheHandOnAConvexWall) {
  expectForceOfNearest(kOutside, {{1e-6, 1.0632}});
}

}  // namespace
}  // namespace hapticd::rt
