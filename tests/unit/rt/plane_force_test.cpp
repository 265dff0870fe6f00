// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <vector>

#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/fixtures/closed_forms.h"
#include "tests/unit/rt/scene/made_up_scene.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using test::planeForce;
using test::planeForceOfAll;

constexpr double k = 500;
constexpr double D = 0.04;
constexpr int kAllPoints = drivers::kKinectPixels;

/// A plane perpendicular to the optical axis: every pixel has the same raw value, whose depth is exactly
/// `depth_m`, so the points form an exact square lattice (or nearly square if fx and fy differ).
class LatticePlane {
 public:
  LatticePlane(double depth_m, double fx_px, double fy_px)
      : depth_m_(depth_m),
        model_(std::make_unique<DepthModel>(intrinsics(depth_m, fx_px, fy_px), PoseParameters{})),
        built_(*model_, wholeFrameGrid(depth_m)),
        memory_(drivers::kKinectPixels),
        pitch_x_m(depth_m / fx_px),
        pitch_y_m(depth_m / fy_px) {
    built_.build(*test::frameOf(kRaw));
  }

  /// Returns the force at height h above the plane, `x` and `y` pitches from a point near the middle of the
  /// image.
  ForceSample force(double h, double x, double y, const SpringParameters& parameters) {
    return nearestSprings(built_.scene, {(x + 0.5) * pitch_x_m, (y + 0.5) * pitch_y_m, h - depth_m_},
                          parameters, memory_);
  }

  /// Returns its normal component averaged over `count` x `count` places between four points, which
  /// approximates a plane without grain.
  double meanNormalForce(double h, int count, const SpringParameters& parameters) {
    double sum = 0;
    for (int i = 0; i < count * count; ++i) {
      const double x = (i % count + 0.5) / count;
      const double y = (i / count + 0.5) / count;
      sum += force(h, x, y, parameters).force_n_in_world.z;
    }
    return sum / (count * count);
  }

  double density_per_m2() const { return 1 / (pitch_x_m * pitch_y_m); }
  /// Returns the radius of the disc that holds `points` points.
  double discRadius_m(double points) const {
    return std::sqrt(points / (std::numbers::pi * density_per_m2()));
  }

 private:
  static constexpr std::uint16_t kRaw = 1024;
  static DepthModelParameters intrinsics(double depth_m, double fx_px, double fy_px) {
    DepthModelParameters m;
    m.a_per_m = -0x1p-12;
    m.b_per_m = 1 / depth_m + kRaw * 0x1p-12;
    m.near_m = depth_m * 0.9;
    m.far_m = depth_m * 1.1;
    m.fx_px = fx_px;
    m.fy_px = fy_px;
    m.cx_px = 319.5;
    m.cy_px = 239.5;
    return m;
  }
  static GridParameters wholeFrameGrid(double depth_m) {
    GridParameters grid;
    grid.extent = ModelExtent::frame;
    grid.frame_voxel_edge_m = std::max(0.01, depth_m / 100);
    return grid;
  }

  double depth_m_;
  std::unique_ptr<DepthModel> model_;
  BuiltScene built_;
  SearchMemory memory_;

 public:
  const double pitch_x_m, pitch_y_m;
};

/// 0.175 mm between points, 84 mm of plane: the ball of radius D_thresh fits, with up to 164 000 points in
/// it.
LatticePlane densePlane() {
  return {1.0, 1 / 0.175e-3, 1 / 0.175e-3};
}

/// Returns the largest difference in newtons between the mean over lattice points and the mean over the disc
/// of radius `disc_m` that they represent:
/// - inside, each point represents its cell; its own value differs from the cell's mean by the curvature of f
/// = k h (D/s - 1), which is nowhere above k D / h^2: p^2/12 * k D / h^2;
/// - at the border, the cells cover the disc except for a ring of half a cell's diagonal e inwards and
/// outwards; this fraction 4 e / disc of the area may have a force that differs by 2 e * |df/dr|, with
/// |df/dr| = k h D r / s^3 at r = disc.
double latticeTolerance_n(double h, double disc_m, double pitch_m) {
  const double e = pitch_m / std::numbers::sqrt2;
  const double s = std::hypot(h, disc_m);
  const double slope = k * h * D * disc_m / (s * s * s);
  return pitch_m * pitch_m / 12 * k * D / (h * h) + 4 * e / disc_m * 2 * e * slope;
}

TEST(PlaneForce, IsTheClosedFormOfAllPoints) {
  LatticePlane plane = densePlane();
  const SpringParameters all{k, D, 1, kAllPoints};
  for (const double h : {0.002, 0.005, 0.010, 0.0165685, 0.020, 0.030, 0.039}) {
    const ForceSample sample = plane.force(h, 0.3, 0.2, all);
    const double disc = std::sqrt(D * D - h * h);
    // A lattice has a few points more or fewer than its density predicts, and the force is divided by N. The
    // difference is known, because N was counted. The ring at the border contributes almost no force (f = 0
    // at s = D), so the rest is the lattice's tolerance.
    const double promised = std::numbers::pi * disc * disc * plane.density_per_m2();
    const double expected = planeForceOfAll(k, D, h);
    const double tolerance =
        expected * std::abs(sample.points_used / promised - 1) + latticeTolerance_n(h, disc, plane.pitch_x_m);
    EXPECT_LT(tolerance, 0.01 * expected + 0.02) << "the oracle is too inaccurate";
    EXPECT_NEAR(sample.force_n_in_world.z, expected, tolerance) << h;
  }
}

TEST(PlaneForce, IsTheClosedFormOfTheNNearest) {
  LatticePlane plane = densePlane();
  for (const double a_N_wanted : {0.005, 0.010, 0.020}) {
    const SpringParameters nearest{
        k, D, 10, static_cast<int>(std::numbers::pi * a_N_wanted * a_N_wanted * plane.density_per_m2())};
    const double a_N = plane.discRadius_m(nearest.max_points);
    for (const double h : {0.001, 0.002, 0.005, 0.010, 0.020, 0.030}) {
      const ForceSample sample = plane.force(h, 0.3, 0.2, nearest);
      EXPECT_EQ(sample.points_used, static_cast<std::uint32_t>(nearest.max_points));
      EXPECT_NEAR(sample.force_n_in_world.z, planeForce(k, D, a_N, h),
                  latticeTolerance_n(h, a_N, plane.pitch_x_m))
          << h << ' ' << a_N;
    }
  }
}

TEST(PlaneForce, SwitchesFromTheNNearestToAllPointsWhereTheBallHoldsNoMoreThanN) {
  LatticePlane plane = densePlane();
  const double a_N_wanted = 0.030;
  const SpringParameters nearest{
      k, D, 10, static_cast<int>(std::numbers::pi * a_N_wanted * a_N_wanted * plane.density_per_m2())};
  const double a_N = plane.discRadius_m(nearest.max_points);
  const double h_s = std::sqrt(D * D - a_N * a_N);
  for (const double h : {h_s - 0.002, h_s - 0.0005, h_s + 0.0005, h_s + 0.002}) {
    const ForceSample sample = plane.force(h, 0.1, 0.4, nearest);
    EXPECT_EQ(sample.points_used == static_cast<std::uint32_t>(nearest.max_points), h < h_s);
    const double disc = std::min(a_N, std::sqrt(D * D - h * h));
    const double promised = std::numbers::pi * disc * disc * plane.density_per_m2();
    const double expected = planeForce(k, D, a_N, h);
    EXPECT_NEAR(sample.force_n_in_world.z, expected,
                expected * std::abs(sample.points_used / promised - 1) +
                    latticeTolerance_n(h, disc, plane.pitch_x_m));
  }
}

TEST(PlaneForce, IsOddInTheHeightAndThereforePullsTheHandOnBehindTheSurface) {
  LatticePlane plane = densePlane();
  const SpringParameters nearest{k, D, 10, 2000};
  for (const double h : {0.0001, 0.001, 0.005, 0.02, 0.039}) {
    const Vec3 in_front = plane.force(h, 0.3, 0.2, nearest).force_n_in_world;
    const Vec3 behind = plane.force(-h, 0.3, 0.2, nearest).force_n_in_world;
    EXPECT_GT(in_front.z, 0);
    // Mirrored positions are rounded separately: 1e-16 m, at distances down to 0.03 mm, times k D.
    EXPECT_NEAR(behind.z, -in_front.z, 1e-9);
    EXPECT_NEAR(behind.x, in_front.x, 1e-9);
    EXPECT_NEAR(behind.y, in_front.y, 1e-9);
  }
}

/// Height and magnitude of the largest force above a plane.
struct Peak {
  double h_m;
  double force_n;
};

/// Returns the highest value of a smooth curve with one maximum in [from, to], by ternary search.
Peak summitOf(double from, double to, const std::function<double(double)>& curve) {
  while (to - from > 0.00005) {
    const double left = from + (to - from) / 3;
    const double right = to - (to - from) / 3;
    if (curve(left) < curve(right)) {
      from = left;
    } else {
      to = right;
    }
  }
  return {(from + to) / 2, curve((from + to) / 2)};
}

struct PeakRow {
  double depth_m;
  double peak_n;   // column F_pt (fx fy) of the table
  double peak_mm;  // column h* (fx fy) of the table
};

class PlanePeak : public testing::TestWithParam<PeakRow> {};

TEST_P(PlanePeak, IsThatOfTheTableForTheRealLattice) {
  const DepthModelParameters kinect;
  LatticePlane plane(GetParam().depth_m, kinect.fx_px, kinect.fy_px);
  const SpringParameters paper;
  const double expected_h = GetParam().peak_mm / 1000;
  const Peak peak = summitOf(expected_h - 0.003, expected_h + 0.003,
                             [&](double h) { return plane.meanNormalForce(h, 8, paper); });
  // The table has two decimals. Averaged over 64 places, the border ring of latticeTolerance_n() cancels and
  // the curvature term remains, which near the peak is p^2/12 * f'' with f'' at most k D / s^2; s is at least
  // h*.
  const double pitch = plane.pitch_x_m;
  const double grain = pitch * pitch / 12 * k * D / (expected_h * expected_h);
  EXPECT_NEAR(peak.force_n, GetParam().peak_n, 0.005 + grain);
  // Where a curve is flat, forces that differ by g belong to heights that differ by sqrt(2 g / F''), twice
  // that if g may raise one side and lower the other; F'' comes from the closed form.
  const double a_N = plane.discRadius_m(paper.max_points);
  const double step = 0.0005;
  const double bend = (2 * planeForce(k, D, a_N, expected_h) - planeForce(k, D, a_N, expected_h - step) -
                       planeForce(k, D, a_N, expected_h + step)) /
                      (step * step);
  EXPECT_NEAR(peak.h_m, expected_h, 5e-6 + 2 * std::sqrt(2 * grain / bend));
}

INSTANTIATE_TEST_SUITE_P(AtDepth, PlanePeak,
                         testing::Values(PeakRow{0.50, 14.61, 6.67}, PeakRow{0.80, 12.82, 8.60},
                                         PeakRow{0.90, 12.30, 9.13}, PeakRow{1.00, 11.81, 9.62},
                                         PeakRow{1.25, 10.68, 10.66}, PeakRow{1.50, 9.67, 11.50},
                                         PeakRow{2.00, 7.92, 12.71}, PeakRow{2.50, 6.47, 13.41},
                                         PeakRow{3.00, 5.23, 13.71}, PeakRow{3.50, 4.17, 13.65}),
                         [](const auto& instance) {
                           return std::to_string(std::lround(instance.param.depth_m * 1000)) + "mm";
                         });

TEST(PlaneForce, IsThatOfAllPointsInTheFarRange) {
  // From 4.20 m on, fewer than N_max points of the real lattice fit into the ball.
  const DepthModelParameters kinect;
  LatticePlane plane(4.3, kinect.fx_px, kinect.fy_px);
  const SpringParameters paper;
  constexpr int kPlaces = 16;  // per axis
  for (const double h : {0.005, 0.010, 0.016569, 0.025, 0.033}) {
    // Averaged over a cell of the lattice, the sum of forces is exactly the integral times the density, and
    // the number of points exactly the area times the density. What remains is that N varies from place to
    // place together with the sum: at most F * (spread of N / N)^2, and the grid of places.
    double sum = 0;
    double points = 0;
    double points_squared = 0;
    for (int i = 0; i < kPlaces * kPlaces; ++i) {
      const ForceSample sample =
          plane.force(h, (i % kPlaces + 0.5) / kPlaces, (i / kPlaces + 0.5) / kPlaces, paper);
      ASSERT_LT(sample.points_used, 100U);
      sum += sample.force_n_in_world.z;
      points += sample.points_used;
      points_squared += sample.points_used * sample.points_used;
    }
    constexpr double kCount = kPlaces * kPlaces;
    const double mean = points / kCount;
    const double variance = points_squared / kCount - mean * mean;
    const double promised = std::numbers::pi * (D * D - h * h) * plane.density_per_m2();
    const double expected = planeForceOfAll(k, D, h);
    const double tolerance = expected * (2 * variance / (mean * mean) + std::abs(mean / promised - 1));
    EXPECT_LT(tolerance, 0.02 * expected) << "the oracle is too inaccurate";
    EXPECT_NEAR(sum / kCount, expected, tolerance) << h;
  }
}

TEST(PlaneForce, BeginsWhereTheBallHoldsNMinPoints) {
  LatticePlane plane = densePlane();
  for (const int min_points : {10, 100, 1000}) {
    const SpringParameters parameters{k, D, min_points, kAllPoints};
    // The disc of N_min points has this radius within half a cell's diagonal.
    const double disc = plane.discRadius_m(min_points);
    const double e = plane.pitch_x_m / std::numbers::sqrt2;
    const double surely_above = std::sqrt(D * D - (disc - e) * (disc - e));
    const double surely_below = std::sqrt(D * D - (disc + e) * (disc + e));
    for (const double place : {0.0, 0.2, 0.5}) {
      const ForceSample above = plane.force(surely_above, place, 0.3, parameters);
      EXPECT_EQ(above.points_used, 0U);
      EXPECT_EQ(above.force_n_in_world, Vec3{});
      const ForceSample below = plane.force(surely_below, place, 0.3, parameters);
      EXPECT_GE(below.points_used, static_cast<std::uint32_t>(min_points));
      // The onset jumps to F_all there; its ring has the force k h (D/s - 1) between 0 at s = D and twice the
      // mean in the middle, so for any distribution of the few points the mean is between 0 and twice F_all.
      EXPECT_GT(below.force_n_in_world.z, 0);
      EXPECT_LT(below.force_n_in_world.z, 2 * planeForceOfAll(k, D, surely_below));
    }
  }
}

constexpr double kPitch_m = 0.175e-3;
const SpringParameters kAll{k, D, 1, drivers::kKinectPixels};

/// Each point of a lattice represents its cell: the mean over the cell differs from the point's own force by
/// p^2/12 times the curvature of the force, which is at most k D / h^2.
double grain_n(double h, double pitch_m) {
  return pitch_m * pitch_m / 12 * k * D / (h * h);
}

DepthModelParameters intrinsics(double nearest_m, double farthest_m) {
  DepthModelParameters m;
  m.fx_px = m.fy_px = 1 / kPitch_m;
  m.cx_px = 319.5;
  m.cy_px = 239.5;
  test::spreadRawValuesOver(nearest_m, farthest_m, m);
  return m;
}

/// A frame that is modelled completely and evaluated by nearestSprings().
class Evaluated {
 public:
  Evaluated(const DepthModelParameters& parameters, const DepthFrame& frame)
      : model_(std::make_unique<DepthModel>(parameters, PoseParameters{})),
        built_(*model_, test::wholeFrameGrid()),
        memory_(drivers::kKinectPixels) {
    built_.build(frame);
  }
  ForceSample at(const Vec3& hip, const SpringParameters& parameters) {
    return nearestSprings(built_.scene, hip, parameters, memory_);
  }

 private:
  std::unique_ptr<DepthModel> model_;
  test::BuiltScene built_;
  SearchMemory memory_;
};

TEST(EdgeForce, AboveAHalfPlanesEdgeIsTheClosedFormNormalAndLateral) {
  // The left half of the image is a plane at 1 m, the right half is empty: the cells of the last column end
  // at x = 0.
  Evaluated frame(intrinsics(1, 1.1),
                  *test::frameOf([](int u, int) { return u < 320 ? 0 : drivers::kKinectNoMeasurement; }));
  struct Row {
    double h_m, lateral_n, normal_n;
  };
  for (const Row& row : {Row{0.003, 4.07, 1.29}, Row{0.010, 3.18, 3.00}, Row{0.020, 1.76, 3.33}}) {
    const double h = row.h_m;
    const ForceSample sample = frame.at({0, 0.3 * kPitch_m, -1 + h}, kAll);
    // N is counted, and the force is divided by it.
    const double promised = std::numbers::pi / 2 * (D * D - h * h) / (kPitch_m * kPitch_m);
    const double count_error = std::abs(sample.points_used / promised - 1);
    EXPECT_LT(count_error, 0.005) << "the oracle is too inaccurate";
    const double grain = grain_n(h, kPitch_m);
    const double lateral = test::edgeLateralForce(k, D, h);
    const double normal = test::planeForceOfAll(k, D, h);
    EXPECT_NEAR(sample.force_n_in_world.x, lateral, count_error * lateral + grain);
    EXPECT_NEAR(sample.force_n_in_world.z, normal, count_error * normal + grain);
    EXPECT_NEAR(lateral, row.lateral_n, 0.005);
    EXPECT_NEAR(normal, row.normal_n, 0.005);
  }
}

TEST(EdgeForce, BetweenTwoSheetsIsTheMeanOfBothAndFlipsInTheMiddle) {
  // Every other pixel belongs to a sheet at 1.00 m, the others to one at 1.06 m, less than 2 D apart.
  constexpr double kFront_m = 1.00;
  constexpr double kBack_m = 1.06;
  const DepthModelParameters parameters = intrinsics(kFront_m, kBack_m);
  Evaluated both(parameters, *test::checkerboardFrame(0, 2046));
  Evaluated front_alone(parameters, *test::checkerboardFrame(0, drivers::kKinectNoMeasurement));
  Evaluated back_alone(parameters, *test::checkerboardFrame(drivers::kKinectNoMeasurement, 2046));
  for (const double depth_m : {1.022, 1.026, 1.034, 1.038}) {
    const Vec3 hip{0.0001, 0.0002, -depth_m};
    const double behind_front = depth_m - kFront_m;
    const double before_back = kBack_m - depth_m;
    const double front_n = -test::planeForceOfAll(k, D, behind_front);
    const double back_n = test::planeForceOfAll(k, D, before_back);
    // At the depth Z a sheet with half of the pixels has pi (D^2 - h^2) / (2 p^2 Z^2) points in range.
    const double per_area = std::numbers::pi / 2 / (kPitch_m * kPitch_m);
    const double front = per_area * (D * D - behind_front * behind_front) / (kFront_m * kFront_m);
    const double back = per_area * (D * D - before_back * before_back) / (kBack_m * kBack_m);
    // A sheet contributes in proportion to its points, which are counted, so its force may deviate by that
    // fraction.
    const double front_error = std::abs(front_alone.at(hip, kAll).points_used / front - 1);
    const double back_error = std::abs(back_alone.at(hip, kAll).points_used / back - 1);
    EXPECT_LT(front_error + back_error, 0.02) << "the oracle is too inaccurate";
    const double tolerance = (front_error + back_error) * (back_n - front_n);
    const ForceSample sample = both.at(hip, kAll);
    EXPECT_NEAR(sample.force_n_in_world.z, (front * front_n + back * back_n) / (front + back),
                tolerance + grain_n(std::min(behind_front, before_back), std::numbers::sqrt2 * kPitch_m));
    EXPECT_EQ(sample.force_n_in_world.z < 0, depth_m < 1.03) << "pushed on by the sheet in front";
  }
}

TEST(EdgeForce, OfADepthStepBeyondTheRadiusIsThatOfTheEdgeAlone) {
  const DepthModelParameters parameters = intrinsics(1, 1.2);
  Evaluated step(parameters, *test::frameOf([](int u, int) -> std::uint16_t { return u < 320 ? 0 : 2046; }));
  Evaluated edge(parameters,
                 *test::frameOf([](int u, int) { return u < 320 ? 0 : drivers::kKinectNoMeasurement; }));
  for (const double h : {0.002, 0.01, 0.03}) {
    for (const double x : {-0.02, 0.0, 0.02}) {
      const ForceSample with = step.at({x, 0, -1 + h}, {});
      const ForceSample without = edge.at({x, 0, -1 + h}, {});
      EXPECT_EQ(with.points_used, without.points_used);
      EXPECT_LT(norm(with.force_n_in_world - without.force_n_in_world), 1e-11);  // 100 terms in another order
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
