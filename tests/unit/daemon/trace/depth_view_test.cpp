// SPDX-License-Identifier: Apache-2.0
// What depth frames become in messages: points, millimetres, numbers of the camera.
#include "daemon/trace/ros/depth_view.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "rt/base/pose.h"

namespace hapticd::trace::ros {
namespace {

constexpr std::uint32_t kWidth = 64, kHeight = 48;

/// A frame of a small camera with padded rows, looking anywhere, with raw values of all kinds, most of them
/// measurements.
struct Picture {
  explicit Picture(rt::DepthLawKind law) {
    header.width_px = kWidth;
    header.height_px = kHeight;
    header.stride_bytes = 2 * kWidth + 6;
    header.depth_law = law;
    const bool is_linear = law == rt::DepthLawKind::linear;
    header.raw_no_measurement = is_linear ? 0 : 2047;
    header.depth_law_coefficients =
        is_linear ? std::array{0.00025, 0.0} : std::array{-0.003071102, 3.330949516};
    header.fx_px = 59.4;
    header.fy_px = 59.1;
    header.cx_px = 33.9;
    header.cy_px = 24.3;
    header.rotation_world_camera = rt::rotationOf({{}, 0.7, -0.4, 2.1});
    header.position_m_in_world = {0.3, -1.2, 0.8};
    header.exposure_ns = 11;
    header.arrival_ns = 12;
    std::mt19937 random(5);
    // disparities from 1085 on mean a place behind the camera
    for (std::uint16_t& value : raw) {
      value = static_cast<std::uint16_t>(random() % (is_linear ? 65536 : 1300));
      if (random() % 10 == 0) value = static_cast<std::uint16_t>(header.raw_no_measurement);
    }
  }
  DepthView view() const {
    DepthView view;
    view.set(header, std::as_bytes(std::span(raw)));
    return view;
  }
  std::uint16_t& at(std::uint32_t column, std::uint32_t row) {
    return raw[row * (header.stride_bytes / 2) + column];
  }
  std::uint16_t at(std::uint32_t column, std::uint32_t row) const {
    return raw[row * (header.stride_bytes / 2) + column];
  }
  /// Z by the formulas of DepthLawKind; 0: no measurement, nothing in front of the camera, or beyond 20 m.
  double depth_m(std::uint16_t value) const {
    if (value == header.raw_no_measurement) return 0;
    const double law = header.depth_law_coefficients[0] * value + header.depth_law_coefficients[1];
    if (law <= 0) return 0;
    const double depth = header.depth_law == rt::DepthLawKind::linear ? law : 1 / law;
    return depth <= 20 ? depth : 0;
  }
  /// The place that a pixel sees, in the optical frame.
  rt::Vec3 pointOf(std::uint32_t column, std::uint32_t row, double z) const {
    return {(column - header.cx_px) / header.fx_px * z, (row - header.cy_px) / header.fy_px * z, z};
  }
  /// x right, y up and looking along -z there.
  rt::Vec3 inWorld(const rt::Vec3& p) const {
    const auto& r = header.rotation_world_camera;
    const auto& t = header.position_m_in_world;
    return {r[0] * p.x - r[1] * p.y - r[2] * p.z + t[0], r[3] * p.x - r[4] * p.y - r[5] * p.z + t[1],
            r[6] * p.x - r[7] * p.y - r[8] * p.z + t[2]};
  }

  rt::DepthFrameHeader header;
  std::vector<std::uint16_t> raw = std::vector<std::uint16_t>(std::size_t{kWidth + 3} * kHeight);
};

/// Disparities of 0.5 to 2 m, and pixels without measurement.
Picture nearPicture() {
  Picture picture(rt::DepthLawKind::reciprocal);
  std::mt19937 random(3);
  for (std::uint16_t& value : picture.raw)
    value = static_cast<std::uint16_t>(random() % 10 == 0 ? 2047 : 440 + random() % 480);
  return picture;
}

class PointsOf : public ::testing::TestWithParam<std::tuple<rt::DepthLawKind, std::uint32_t>> {};
INSTANTIATE_TEST_SUITE_P(LawsAndSteps, PointsOf,
                         ::testing::Combine(::testing::Values(rt::DepthLawKind::reciprocal,
                                                              rt::DepthLawKind::linear),
                                            ::testing::Values(1, 5)));

TEST_P(PointsOf, AFrameAreThoseOfItsMeasuredPixelsAndNoOthers) {
  const auto [law, step] = GetParam();
  const Picture picture(law);
  std::vector<float> xyz_m(7, 1);  // of an earlier frame
  picture.view().points(xyz_m, step);
  std::size_t at = 0;
  for (std::uint32_t row = 0; row < kHeight; row += step) {
    for (std::uint32_t column = 0; column < kWidth; column += step) {
      const double z = picture.depth_m(picture.at(column, row));
      if (z == 0) continue;
      ASSERT_LE(at + 3, xyz_m.size());
      const rt::Vec3 exact = picture.pointOf(column, row, z);
      for (const double component : {exact.x, exact.y, exact.z}) {
        // two factors and their product are each rounded to single precision: 3/2 units in the last place
        EXPECT_NEAR(xyz_m[at++], component, 2 * 0x1p-23 * std::abs(component)) << column << " " << row;
      }
    }
  }
  EXPECT_EQ(at, xyz_m.size());
}

class DepthViewOf : public ::testing::TestWithParam<rt::DepthLawKind> {};
INSTANTIATE_TEST_SUITE_P(Laws, DepthViewOf,
                         ::testing::Values(rt::DepthLawKind::reciprocal, rt::DepthLawKind::linear));

TEST_P(DepthViewOf, AnImageIsInWholeMillimetres) {
  const Picture picture(GetParam());
  DepthImage image{.width_px = 1, .height_px = 1, .depth_mm = {9}};
  picture.view().millimetres(image);
  ASSERT_EQ(image.width_px, kWidth);
  ASSERT_EQ(image.height_px, kHeight);
  ASSERT_EQ(image.depth_mm.size(), kWidth * kHeight);
  std::size_t none = 0;
  for (std::uint32_t row = 0; row < kHeight; ++row) {
    for (std::uint32_t column = 0; column < kWidth; ++column) {
      const double depth_mm = 1000 * picture.depth_m(picture.at(column, row));
      const std::uint16_t shown = image.depth_mm[row * kWidth + column];
      if (depth_mm == 0) {
        EXPECT_EQ(shown, 0) << column << " " << row;
        ++none;
      } else {
        EXPECT_NEAR(shown, depth_mm, 0.5 + 1e-9) << column << " " << row;
      }
    }
  }
  EXPECT_GT(none, 0U);
}

TEST(DepthView, HasTheNumbersOfTheCameraAndTheTimeOfMeasurement) {
  Picture picture(rt::DepthLawKind::linear);
  const DepthView view = picture.view();
  EXPECT_EQ(view.camera(), (PinholeCamera{kWidth, kHeight, 59.4, 59.1, 33.9, 24.3}));
  EXPECT_EQ(view.time_ns(), 11);
  picture.header.exposure_ns = 0;  // not known
  EXPECT_EQ(view.time_ns(), 12);
}

TEST(DepthView, FollowsACameraThatChanges) {
  const Picture kinect(rt::DepthLawKind::reciprocal), other(rt::DepthLawKind::linear);
  DepthView view = kinect.view();
  std::vector<float> after_change, alone;
  view.points(after_change);
  view.set(other.header, std::as_bytes(std::span(other.raw)));
  view.points(after_change);
  other.view().points(alone);
  EXPECT_EQ(after_change, alone);
}

TEST(DepthView, ValuesBeyondTheFarthestAndBehindTheCameraHaveNoPoint) {
  Picture picture(rt::DepthLawKind::reciprocal);
  std::ranges::fill(picture.raw, std::uint16_t{2047});
  picture.at(0, 0) = 1068;  // 20.0 m are at 1068.3
  picture.at(1, 0) = 1069;
  picture.at(2, 0) = 1100;  // negative
  std::vector<float> xyz_m;
  picture.view().points(xyz_m);
  EXPECT_EQ(xyz_m.size(), 3U);
}

TEST(DepthView, ABallHoldsExactlyThePointsWithinItsRadius) {
  const Picture picture = nearPicture();
  const DepthView view = picture.view();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> radius_m(0.02, 1.2);
  std::size_t all = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const auto column = static_cast<std::uint32_t>(random() % kWidth);
    const auto row = static_cast<std::uint32_t>(random() % kHeight);
    const ModelledBall ball{picture.inWorld(picture.pointOf(column, row, picture.depth_m(700))),
                            radius_m(random)};
    std::vector<float> expected;
    for (std::uint32_t v = 0; v < kHeight; ++v) {
      for (std::uint32_t u = 0; u < kWidth; ++u) {
        const double z = picture.depth_m(picture.at(u, v));
        const rt::Vec3 point = picture.pointOf(u, v, z);
        if (z == 0 || rt::norm(picture.inWorld(point) - ball.centre_m_in_world) > ball.radius_m) continue;
        for (const double component : {point.x, point.y, point.z})
          expected.push_back(static_cast<float>(component));
      }
    }
    std::vector<float> found(7, 1);
    view.pointsInBall(ball, found);
    ASSERT_EQ(found.size(), expected.size()) << trial;
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], expected[i], 1e-6) << trial;
    all += found.size();
  }
  EXPECT_GT(all, 3000U);
}

TEST(DepthView, NothingIsInABallBehindTheCameraOrWithoutRadiusOrWithoutPlace) {
  const Picture picture = nearPicture();
  const DepthView view = picture.view();
  const rt::Vec3 in_front = picture.inWorld({0, 0, 1});
  std::vector<float> xyz_m;
  view.pointsInBall({in_front, 1}, xyz_m);
  EXPECT_FALSE(xyz_m.empty());
  for (const ModelledBall& ball : {ModelledBall{in_front, 0}, ModelledBall{picture.inWorld({0, 0, -1}), 0.5},
                                   ModelledBall{{std::nan(""), 0, 0}, 1}}) {
    view.pointsInBall(ball, xyz_m);
    EXPECT_TRUE(xyz_m.empty()) << ball.radius_m;
  }
}

}  // namespace
}  // namespace hapticd::trace::ros
