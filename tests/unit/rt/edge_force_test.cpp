// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

#include "drivers/camera/kinect_image.h"
#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/fixtures/closed_forms.h"
#include "tests/unit/rt/scene/built_scene.h"
#include "tests/unit/rt/scene/made_up_frame.h"

namespace hapticd::rt {
namespace {

constexpr double k = 500;
constexpr double D = 0.04;
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
