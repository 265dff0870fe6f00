#include "rt/surface_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "rt/disparity_filter.h"
#include "rt/scene.h"
#include "rt/surface_field_builder.h"

namespace hapticd::test {
namespace {

using rt::SurfaceField;
using rt::Vec3;

/// A field whose nodes hold `value`.
class MadeField {
 public:
  MadeField(double voxel_edge_m, const std::function<double(const Vec3&)>& value)
      : nodes_(SurfaceField::kNodes) {
    field.voxel_edge_m = voxel_edge_m;
    field.origin_m_in_world = {-16 * voxel_edge_m, -16 * voxel_edge_m, -16 * voxel_edge_m};
    field.radius_m = 13 * voxel_edge_m;
    field.distance_m = nodes_.data();
    std::size_t index = 0;
    for (int k = 0; k < SurfaceField::kNodesPerAxis; ++k) {
      for (int j = 0; j < SurfaceField::kNodesPerAxis; ++j) {
        for (int i = 0; i < SurfaceField::kNodesPerAxis; ++i) {
          const Vec3 node{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
          nodes_[index++] = static_cast<float>(value(field.origin_m_in_world + voxel_edge_m * node));
        }
      }
    }
  }

  SurfaceField field;

 private:
  std::vector<float> nodes_;
};

std::vector<Vec3> placesWithin(double half_edge_m) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-half_edge_m, half_edge_m);
  std::vector<Vec3> places;
  for (int i = 0; i < 2000; ++i)
    places.push_back({coordinate(random), coordinate(random), coordinate(random)});
  return places;
}

TEST(SampleField, IsExactOnQuadraticFields) {
  const auto quadratic = [](const Vec3& p) {
    return 0.01 + 0.3 * p.x - 0.2 * p.y + 0.9 * p.z + 2 * p.x * p.x - 3 * p.y * p.y + 1.5 * p.z * p.z;
  };
  const MadeField made(0.01, quadratic);
  for (const Vec3& p : placesWithin(0.08)) {
    const rt::FieldSample sample = sampleField(made.field, p);
    EXPECT_NEAR(sample.distance_m, quadratic(p), 1e-7);  // single precision of values up to 0.4
    const Vec3 gradient{0.3 + 4 * p.x, -0.2 - 6 * p.y, 0.9 + 3 * p.z};
    EXPECT_LE(norm(sample.gradient_in_world - gradient), 1e-4);
  }
}

TEST(SampleField, RoundsASphereLessThanTrilinearInterpolationDoes) {
  // trilinear on 10 mm voxels errs by up to s^2 / (4 R) = 0.5 mm and 9.5 degrees near a sphere of 5 cm
  constexpr double kRadius_m = 0.05;
  const MadeField made(0.01, [](const Vec3& p) { return norm(p) - kRadius_m; });
  double largest_value = 0;
  double largest_angle = 0;
  for (const Vec3& p : placesWithin(0.06)) {
    if (std::abs(norm(p) - kRadius_m) > 0.005) continue;
    const rt::FieldSample sample = sampleField(made.field, p);
    largest_value = std::max(largest_value, std::abs(sample.distance_m - (norm(p) - kRadius_m)));
    const double cosine = dot(sample.gradient_in_world, p) / (norm(sample.gradient_in_world) * norm(p));
    largest_angle = std::max(largest_angle, std::acos(std::min(1.0, cosine)));
  }
  EXPECT_LT(largest_value, 1e-4);
  EXPECT_LT(largest_angle, 1.5 * M_PI / 180);
}

TEST(SampleField, IsContinuousAcrossVoxelFaces) {
  const MadeField made(0.01, [](const Vec3& p) { return norm(p) - 0.05; });
  for (const Vec3& p : placesWithin(0.08)) {
    const Vec3 face{0.01 * std::round(p.x / 0.01), p.y, p.z};
    const rt::FieldSample below = sampleField(made.field, face - Vec3{1e-9, 0, 0});
    const rt::FieldSample above = sampleField(made.field, face + Vec3{1e-9, 0, 0});
    EXPECT_NEAR(below.distance_m, above.distance_m, 1e-7);
    EXPECT_LE(norm(below.gradient_in_world - above.gradient_in_world), 2e-5);
  }
}

/// A builder with the disparities of any surface z = -depth(x / Z, y / Z).
class BuiltField {
 public:
  explicit BuiltField(const std::function<double(double, double)>& inverse_depth)
      : disparity_(rt::kFramePixels + 2 * rt::kVectorPadding, rt::kNoDisparity),
        nodes_(SurfaceField::kNodes) {
    field.distance_m = nodes_.data();
    const rt::DepthModelParameters camera;
    for (int row = 0; row < rt::kFrameHeight; ++row) {
      for (int column = 0; column < rt::kFrameWidth; ++column) {
        const double w =
            inverse_depth((column - camera.cx_px) / camera.fx_px, -(row - camera.cy_px) / camera.fy_px);
        if (w <= 0) continue;
        const auto pixel = static_cast<std::size_t>(row * rt::kFrameWidth + column);
        disparity_[pixel] = static_cast<float>((w - camera.b_per_m) / camera.a_per_m);
      }
    }
  }

  void build(const Vec3& centre, const rt::SurfaceParameters& parameters, std::uint64_t frame = 1) {
    builder_.build(disparity_.data(), centre, 0.06, parameters, frame, field);
  }
  void shift(float raw) {
    for (float& d : disparity_) {
      if (d >= 0) d += raw;
    }
  }
  /// Removes the measurements of a square of pixels.
  void punch(int row, int column, int edge) {
    for (int r = row; r < row + edge; ++r) {
      for (int c = column; c < column + edge; ++c) {
        disparity_[static_cast<std::size_t>(r * rt::kFrameWidth + c)] = rt::kNoDisparity;
      }
    }
  }

  SurfaceField field;

 private:
  rt::DepthModel model_{rt::DepthModelParameters{}, rt::PoseParameters{}};
  rt::SurfaceFieldBuilder builder_{model_};
  std::vector<float> disparity_;
  std::vector<float> nodes_;
};

TEST(SurfaceFieldBuilder, GivesTheDistanceFromTiltedPlanes) {
  for (const double tilt_rad : {0.0, 0.5236, 1.0472}) {
    // n . p = -cos(tilt): through (0, 0, -1), turned about x
    const Vec3 normal{0, -std::sin(tilt_rad), std::cos(tilt_rad)};
    BuiltField built([&](double ray_x, double ray_y) {
      return -dot(normal, Vec3{ray_x, ray_y, -1}) / std::cos(tilt_rad);
    });
    for (const double edge : {0.005, 0.01, 0.02}) {
      built.build({0, 0, -1}, {.voxel_edge_m = edge});
      for (const Vec3& offset : placesWithin(0.02)) {
        const Vec3 p = Vec3{0, 0, -1} + offset;
        const double expected = dot(normal, offset);
        if (std::abs(expected) > 1.5 * edge) continue;  // further out the cut-off bends the field
        const rt::FieldSample sample = sampleField(built.field, p);
        EXPECT_NEAR(sample.distance_m, expected, 2e-5) << tilt_rad << " " << edge;
        EXPECT_LE(norm(sample.gradient_in_world - normal), 2e-3) << tilt_rad << " " << edge;
      }
    }
  }
}

TEST(SurfaceFieldBuilder, GivesTheSameNodesWhereverTheWindowLies) {
  const auto bumpy = [](double x, double y) { return 1 + 0.2 * std::sin(20 * x) * std::cos(15 * y); };
  BuiltField here(bumpy);
  BuiltField there(bumpy);
  here.build({0, 0, -1}, {});
  there.build({0.023, -0.031, -1}, {});  // as far away: the blocks are of the same size
  for (const Vec3& offset : placesWithin(0.015)) {
    const Vec3 p = Vec3{0.012, -0.015, -0.99} + offset;
    ASSERT_TRUE(here.field.covers(p, 0) && there.field.covers(p, 0));
    const double from_here = sampleField(here.field, p).distance_m;
    // A node on the border of two blocks may be given to either by the rounding of its pixel; on the surface
    // their planes agree, away from it by their slopes.
    const double tolerance = std::abs(from_here) < 0.005 ? 5e-5 : 3e-4;
    EXPECT_NEAR(from_here, sampleField(there.field, p).distance_m, tolerance);
  }
}

TEST(SurfaceFieldBuilder, ClosesHolesInASurfaceButNoGapBesideAnObject) {
  BuiltField wall([](double, double) { return 1.0; });
  wall.punch(235, 330, 15);  // 2.5 cm
  wall.build({0, 0, -1}, {});
  EXPECT_NEAR(sampleField(wall.field, {0, 0, -1.01}).distance_m, -0.01, 1e-5);

  // a post 1 m away in front of a wall 2 m away, with the projector's shadow beside it
  BuiltField post([](double x, double) { return std::abs(x) < 0.02 ? 1.0 : x > 0 && x < 0.06 ? 0.0 : 0.5; });
  post.build({0.03, 0, -1}, {});
  EXPECT_GT(sampleField(post.field, {0.045, 0, -1.01}).distance_m, 0.01);
}

TEST(SurfaceFieldBuilder, IsFreeInFrontAndUnknownBehindAndFreeWhereNothingIsSeen) {
  BuiltField wall([](double x, double) { return x < 0 ? 1.0 : 0.0; });
  wall.build({0, 0, -1}, {});
  const double cut_off = wall.field.truncation_m();
  EXPECT_NEAR(sampleField(wall.field, {-0.04, 0, -0.96}).distance_m, cut_off, 1e-3);
  EXPECT_NEAR(sampleField(wall.field, {-0.04, 0, -1.042}).distance_m, -cut_off, 1e-3);
  EXPECT_NEAR(sampleField(wall.field, {0.04, 0, -1.04}).distance_m, cut_off, 1e-6);
}

TEST(SurfaceFieldBuilder, FusesStillFramesAndForgetsWhereTheSceneMoves) {
  BuiltField wall([](double, double) { return 1.0; });
  rt::SurfaceParameters parameters;
  parameters.fusion_frames = 4;
  wall.build({0, 0, -1}, parameters, 1);
  wall.shift(1);  // one raw unit, 3.07 mm farther
  wall.build({0, 0, -1}, parameters, 2);
  EXPECT_NEAR(sampleField(wall.field, {0, 0, -1}).distance_m, 0.0031 / 2, 1e-4);
  wall.build({0.01, 0, -1}, parameters, 2);  // the same frame again, around another place: no second time
  EXPECT_NEAR(sampleField(wall.field, {0, 0, -1}).distance_m, 0.0031 / 2, 1e-4);
  wall.shift(4);  // 12 mm: motion
  wall.build({0, 0, -1}, parameters, 3);
  EXPECT_NEAR(sampleField(wall.field, {0, 0, -1.005}).distance_m, 0.0156 - 0.005, 2e-4);
}

}  // namespace
}  // namespace hapticd::test
