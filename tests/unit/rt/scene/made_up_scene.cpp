// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/rt/scene/made_up_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <random>
#include <vector>

#include "rt/base/vec3.h"

namespace hapticd::test {
namespace {

/// Depth of the scene along the ray of a pixel, in the optical frame (x right, y down, z forward).
double planeAndSphereDepth_m(const rt::DepthModelParameters& m, int u, int v) {
  constexpr double kRadius_m = 0.12;
  const auto planeDepth_m = [](double row) { return 1 / (1 / 1.5 + (1 / 0.8 - 1 / 1.5) * row / 479); };
  const auto rayOf = [&m](double column, double row) {
    return rt::Vec3{(column - m.cx_px) / m.fx_px, (row - m.cy_px) / m.fy_px, 1};
  };
  const rt::Vec3 centre = (planeDepth_m(250) - 0.05) * rayOf(300, 250);
  const rt::Vec3 ray = rayOf(u, v);
  const double along = dot(ray, centre);
  const double root = along * along - dot(ray, ray) * (dot(centre, centre) - kRadius_m * kRadius_m);
  const double plane = planeDepth_m(v);
  return root < 0 ? plane : std::min(plane, (along - std::sqrt(root)) / dot(ray, ray));
}

constexpr std::size_t kWordBits = 64;

bool isSet(const std::uint64_t* words, std::size_t bit) {
  return (words[bit / kWordBits] >> (bit % kWordBits) & 1) != 0;
}

void expectPointsInCell(const rt::Scene& scene, std::uint32_t rank, const int (&cell)[3]) {
  const double edge = scene.shape.voxel_edge_m;
  const double slack = scene.depth_model->singlePrecisionError_m();
  for (std::uint32_t i = scene.voxel_begin[rank]; i < scene.voxel_begin[rank + 1]; ++i) {
    const double position[3] = {scene.point[i].x_m, scene.point[i].y_m, scene.point[i].z_m};
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_GE(position[axis], cell[axis] * edge - slack);
      ASSERT_LE(position[axis], (cell[axis] + 1) * edge + slack);
    }
  }
}

/// Visits all voxels in the order x, y, z from fastest to slowest; returns the number of occupied ones.
std::uint32_t checkVoxels(const rt::Scene& scene) {
  const rt::GridShape& shape = scene.shape;
  const auto row_bits = static_cast<std::size_t>(shape.wordsPerRow()) * kWordBits;
  std::uint32_t rank = 0;
  for (std::size_t word = 0; word < shape.words(); ++word) {
    EXPECT_EQ(isSet(scene.touched_words, word), scene.occupancy[word] != 0);
    if (scene.occupancy[word] == 0) continue;
    EXPECT_EQ(scene.word_rank[word], rank);
    for (std::size_t bit = word * kWordBits; bit < (word + 1) * kWordBits; ++bit) {
      if (!isSet(scene.occupancy, bit)) continue;
      const auto row = static_cast<int>(bit / row_bits);
      const int cell[3] = {static_cast<int>(bit % row_bits), row % shape.cells_y, row / shape.cells_y};
      EXPECT_LT(cell[0], shape.cells_x);
      EXPECT_LT(cell[2], shape.cells_z);
      EXPECT_LT(scene.voxel_begin[rank], scene.voxel_begin[rank + 1]) << "an occupied voxel without points";
      expectPointsInCell(scene, rank, cell);
      ++rank;
      if (::testing::Test::HasFatalFailure()) return rank;
    }
  }
  return rank;
}

}  // namespace

FramePointer frameOf(const std::function<std::uint16_t(int, int)>& raw) {
  auto frame = std::make_unique<rt::DepthFrame>();
  for (int v = 0; v < drivers::kKinectHeight; ++v) {
    for (int u = 0; u < drivers::kKinectWidth; ++u) frame->raw[v * drivers::kKinectWidth + u] = raw(u, v);
  }
  frame->sequence = 1;
  return frame;
}

FramePointer frameOf(std::uint16_t raw) {
  return frameOf([raw](int, int) { return raw; });
}

FramePointer frameOfDepth(const rt::DepthModelParameters& model,
                          const std::function<double(int, int)>& depth_m) {
  return frameOf([&](int u, int v) -> std::uint16_t {
    const double depth = depth_m(u, v);
    if (!std::isfinite(depth) || depth <= 0) return drivers::kKinectNoMeasurement;
    const double raw = std::round((1 / depth - model.b_per_m) / model.a_per_m);
    return raw < 0 || raw > 2046 ? drivers::kKinectNoMeasurement : static_cast<std::uint16_t>(raw);
  });
}

FramePointer damagedFrame(std::uint32_t seed) {
  std::mt19937 random(seed);
  return frameOf([&random](int, int) { return static_cast<std::uint16_t>(random()); });
}

FramePointer randomFrame(std::uint32_t seed, std::uint16_t first, std::uint16_t last) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> raw(first, last);
  return frameOf([&](int, int) { return static_cast<std::uint16_t>(raw(random)); });
}

FramePointer planeAndSphereFrame(std::uint32_t seed, const rt::DepthModelParameters& model) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.1);
  return frameOf([&](int u, int v) {
    const double raw = (1 / planeAndSphereDepth_m(model, u, v) - model.b_per_m) / model.a_per_m;
    return static_cast<std::uint16_t>(std::clamp(std::round(raw + noise(random)), 0.0, 2046.0));
  });
}

FramePointer checkerboardFrame(std::uint16_t even, std::uint16_t odd) {
  return frameOf([=](int u, int v) { return (u + v) % 2 == 0 ? even : odd; });
}

void spreadRawValuesOver(double nearest_m, double farthest_m, rt::DepthModelParameters& model) {
  model.b_per_m = 1 / nearest_m;
  model.a_per_m = (1 / farthest_m - 1 / nearest_m) / 2046;
  model.near_m = nearest_m * 0.999;
  model.far_m = farthest_m * 1.001;
}

void expectVoxelsToHoldTheirPoints(const rt::Scene& scene) {
  for (std::size_t bit = scene.shape.words(); bit < scene.shape.summaryWords() * kWordBits; ++bit) {
    ASSERT_FALSE(isSet(scene.touched_words, bit)) << "beyond the last word";
  }
  const std::uint32_t occupied = checkVoxels(scene);
  if (scene.points == 0) {
    EXPECT_EQ(occupied, 0U);
    return;
  }
  EXPECT_EQ(scene.voxel_begin[0], 0U);
  EXPECT_EQ(scene.voxel_begin[occupied], scene.points);
}

void expectAllPointsOfTheBall(const rt::Scene& scene, const tools::PointCloud& cloud) {
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> index_of_pixel(drivers::kKinectPixels, kNone);
  for (std::uint32_t i = 0; i < scene.points; ++i) {
    const std::uint32_t pixel = scene.point[i].pixel;
    std::uint32_t& index =
        index_of_pixel[rt::PackedPixel::row(pixel) * drivers::kKinectWidth + rt::PackedPixel::column(pixel)];
    ASSERT_EQ(index, kNone) << "a point twice";
    index = i;
  }
  const double error = scene.depth_model->singlePrecisionError_m();
  std::size_t found = 0;
  for (std::size_t i = 0; i < cloud.points_m.size(); ++i) {
    const double distance = norm(cloud.points_m[i] - scene.ball_centre_m_in_world);
    const std::uint32_t index = index_of_pixel[cloud.row[i] * drivers::kKinectWidth + cloud.column[i]];
    if (index == kNone) {
      ASSERT_GT(distance, scene.ball_radius_m) << cloud.column[i] << ' ' << cloud.row[i];
      continue;
    }
    ++found;
    const rt::GridPoint& p = scene.point[index];
    const rt::Vec3 position = scene.origin_m_in_world + rt::Vec3{p.x_m, p.y_m, p.z_m};
    ASSERT_EQ(rt::PackedPixel::raw(p.pixel), cloud.raw[i]);
    ASSERT_LE(distance, scene.ball_radius_m + 2 * error) << cloud.column[i] << ' ' << cloud.row[i];
    ASSERT_LE(norm(position - cloud.points_m[i]), error);
  }
  EXPECT_EQ(found, scene.points) << "points that the frame does not have";
}

void expectTheSameScene(const rt::Scene& actual, const rt::Scene& expected) {
  ASSERT_EQ(actual.points, expected.points);
  EXPECT_EQ(actual.points_over_capacity, expected.points_over_capacity);
  EXPECT_EQ(actual.origin_m_in_world, expected.origin_m_in_world);
  EXPECT_EQ(actual.ball_centre_m_in_world, expected.ball_centre_m_in_world);
  EXPECT_EQ(actual.ball_radius_m, expected.ball_radius_m);
  const std::size_t words = expected.shape.words();
  EXPECT_EQ(std::memcmp(actual.occupancy, expected.occupancy, words * sizeof(std::uint64_t)), 0);
  EXPECT_EQ(std::memcmp(actual.touched_words, expected.touched_words,
                        expected.shape.summaryWords() * sizeof(std::uint64_t)),
            0);
  EXPECT_EQ(std::memcmp(actual.point, expected.point, expected.points * sizeof(rt::GridPoint)), 0);
  std::size_t occupied = 0;
  for (std::size_t word = 0; word < words; ++word) {
    occupied += static_cast<std::size_t>(std::popcount(expected.occupancy[word]));
    if (expected.occupancy[word] == 0) continue;
    ASSERT_EQ(actual.word_rank[word], expected.word_rank[word]);
  }
  for (std::size_t rank = 0; expected.points != 0 && rank <= occupied; ++rank) {
    ASSERT_EQ(actual.voxel_begin[rank], expected.voxel_begin[rank]);
  }
}

}  // namespace hapticd::test
