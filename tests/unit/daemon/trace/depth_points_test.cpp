// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/foxglove/foxglove_scene.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "rt/base/pose.h"

namespace hapticd::trace {
namespace {

constexpr std::uint32_t kWidth = 64, kHeight = 48;

/// A small camera with padded rows, looking anywhere.
rt::DepthFrameHeader madeUpHeader() {
  rt::DepthFrameHeader header;
  header.width_px = kWidth;
  header.height_px = kHeight;
  header.stride_bytes = 2 * kWidth + 6;
  header.raw_no_measurement = 2047;
  header.depth_law_coefficients = {-0.003071102, 3.330949516};
  header.fx_px = 59.4;
  header.fy_px = 59.1;
  header.cx_px = 33.9;
  header.cy_px = 24.3;
  header.rotation_world_camera = rt::rotationOf({{}, 0.7, -0.4, 2.1});
  header.position_m_in_world = {0.3, -1.2, 0.8};
  return header;
}

struct Picture {
  rt::DepthFrameHeader header = madeUpHeader();
  std::vector<std::uint16_t> raw = std::vector<std::uint16_t>(header.imageBytes() / 2, 2047);

  std::uint16_t& at(std::uint32_t column, std::uint32_t row) {
    return raw[row * header.stride_bytes / 2 + column];
  }
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(raw)); }
};

/// Disparities of 0.5 to 2 m, and pixels without measurement.
Picture madeUpPicture() {
  Picture picture;
  std::mt19937 random(3);
  for (std::uint32_t row = 0; row < kHeight; ++row) {
    for (std::uint32_t column = 0; column < kWidth; ++column) {
      picture.at(column, row) = static_cast<std::uint16_t>(random() % 10 == 0 ? 2047 : 440 + random() % 480);
    }
  }
  return picture;
}

/// The formulas of DepthFrameHeader, straight.
rt::Vec3 pointOf(const Picture& picture, std::uint32_t column, std::uint32_t row, std::uint16_t raw) {
  const auto& h = picture.header;
  const double z = 1 / (h.depth_law_coefficients[0] * raw + h.depth_law_coefficients[1]);
  return {z * (column - h.cx_px) / h.fx_px, -z * (row - h.cy_px) / h.fy_px, -z};
}

rt::Vec3 inWorld(const rt::DepthFrameHeader& h, const rt::Vec3& p) {
  const auto& r = h.rotation_world_camera;
  const auto& t = h.position_m_in_world;
  return {r[0] * p.x + r[1] * p.y + r[2] * p.z + t[0], r[3] * p.x + r[4] * p.y + r[5] * p.z + t[1],
          r[6] * p.x + r[7] * p.y + r[8] * p.z + t[2]};
}

std::vector<float> append(std::vector<float> points, const rt::Vec3& p) {
  for (const double number : {p.x, p.y, p.z}) points.push_back(static_cast<float>(number));
  return points;
}

TEST(DepthPoints, EveryStepThPixelHasThePointThatItSees) {
  Picture picture = madeUpPicture();
  std::vector<float> expected;
  for (std::uint32_t row = 0; row < kHeight; row += 5) {
    for (std::uint32_t column = 0; column < kWidth; column += 5) {
      const std::uint16_t raw = picture.at(column, row);
      if (raw != 2047) expected = append(expected, pointOf(picture, column, row, raw));
    }
  }
  DepthPoints points;
  const auto found = points.decimated(picture.header, picture.bytes(), 5);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-6) << i;
}

TEST(DepthPoints, ABallHoldsExactlyThePointsWithinItsRadius) {
  Picture picture = madeUpPicture();
  DepthPoints points;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> radius_m(0.02, 1.2);
  std::size_t all = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const auto column = static_cast<std::uint32_t>(random() % kWidth);
    const auto row = static_cast<std::uint32_t>(random() % kHeight);
    const ModelledBall ball{inWorld(picture.header, pointOf(picture, column, row, 700)), radius_m(random)};
    std::vector<float> expected;
    for (std::uint32_t v = 0; v < kHeight; ++v) {
      for (std::uint32_t u = 0; u < kWidth; ++u) {
        if (picture.at(u, v) == 2047) continue;
        const rt::Vec3 point = pointOf(picture, u, v, picture.at(u, v));
        if (rt::norm(inWorld(picture.header, point) - ball.centre_m_in_world) <= ball.radius_m) {
          expected = append(expected, point);
        }
      }
    }
    const auto found = points.inBall(picture.header, picture.bytes(), ball);
    ASSERT_EQ(found.size(), expected.size()) << trial;
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], expected[i], 1e-6) << trial;
    all += found.size();
  }
  EXPECT_GT(all, 3000U);
}

TEST(DepthPoints, NothingIsInABallBehindTheCameraOrWithoutRadiusOrWithoutPlace) {
  const Picture picture = madeUpPicture();
  DepthPoints points;
  const rt::Vec3 in_front = inWorld(picture.header, {0, 0, -1});
  EXPECT_FALSE(points.inBall(picture.header, picture.bytes(), {in_front, 1}).empty());
  EXPECT_TRUE(points.inBall(picture.header, picture.bytes(), {in_front, 0}).empty());
  EXPECT_TRUE(
      points.inBall(picture.header, picture.bytes(), {inWorld(picture.header, {0, 0, 1}), 0.5}).empty());
  EXPECT_TRUE(points.inBall(picture.header, picture.bytes(), {{std::nan(""), 0, 0}, 1}).empty());
}

TEST(DepthPoints, ALinearLawAndANewHeaderAreFollowed) {
  Picture picture;
  picture.at(10, 20) = 1500;
  DepthPoints points;
  (void)points.decimated(picture.header, picture.bytes(), 1);
  picture.header.depth_law = rt::DepthLawKind::linear;
  picture.header.depth_law_coefficients = {0.001, 0};
  picture.header.raw_no_measurement = 0;
  const auto found = points.decimated(picture.header, picture.bytes(), 1);
  ASSERT_EQ(found.size(), 3U * kWidth * kHeight) << "2047 is a measurement now";
  EXPECT_FLOAT_EQ(found[3 * (20 * kWidth + 10) + 2], -1.5F);
}

TEST(DepthPoints, ValuesBeyondTheFarthestAndBehindTheCameraHaveNoPoint) {
  Picture picture;
  picture.at(0, 0) = 1068;  // 20.0 m are at 1068.3
  picture.at(1, 0) = 1069;
  picture.at(2, 0) = 1100;  // negative
  DepthPoints points;
  EXPECT_EQ(points.decimated(picture.header, picture.bytes(), 1).size(), 3U);
}

}  // namespace
}  // namespace hapticd::trace
