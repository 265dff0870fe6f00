// SPDX-License-Identifier: Apache-2.0
// Outlines of solids: closed lines on the boundary, of a bounded size, that show where the solid is.
#include "config/solids/solid_outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "config/solids/solid_file.h"
#include "tests/support/made_solid.h"

namespace hapticd::config {
namespace {

using Shape = std::function<double(const rt::Vec3&)>;

std::shared_ptr<const Solid> solidOf(const std::string& bytes) {
  auto solid = solidFrom(bytes, "a.solid");
  EXPECT_TRUE(solid) << solid.error().text();
  return *solid;
}

std::size_t pointsIn(const std::vector<OutlineLine>& lines) {
  std::size_t points = 0;
  for (const OutlineLine& line : lines) points += line.size();
  return points;
}

/// What must hold for every solid.
void expectSound(const rt::DistanceGrid& grid, const std::vector<OutlineLine>& lines) {
  EXPECT_LE(pointsIn(lines), kMaxOutlinePoints);
  for (const OutlineLine& line : lines) {
    ASSERT_GE(line.size(), 5U) << "a line around a single node has four edges";
    EXPECT_EQ(line.front(), line.back());
    for (const rt::Vec3& point : line)
      EXPECT_LT(std::abs(distanceAt(grid, point).distance_m), grid.spacing_m / 50);
  }
}

double ball(const rt::Vec3& p, const rt::Vec3& centre, double radius_m) {
  return norm(p - centre) - radius_m;
}

/// A ring around the z axis.
double ring(const rt::Vec3& p, double radius_m, double thickness_m) {
  return std::hypot(std::hypot(p.x, p.y) - radius_m, p.z) - thickness_m;
}

TEST(SolidOutline, LiesOnABallOnAllSides) {
  constexpr double kRadius_m = 0.02, kSpacing_m = 0.002;
  const auto solid = solidOf(test::ballBytes(kRadius_m, kSpacing_m));
  const auto lines = outlineOf(solid->grid());
  expectSound(solid->grid(), lines);
  EXPECT_EQ(lines.size(), 3U * kMaxOutlinePlanes) << "a circle in each plane";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double least_m = 1, most_m = -1;
    for (const OutlineLine& line : lines) {
      for (const rt::Vec3& point : line) {
        // the spline's error of a sphere of ten spacings is far below a hundredth of the spacing
        EXPECT_NEAR(norm(point), kRadius_m, 0.03 * kSpacing_m);
        least_m = std::min(least_m, (&point.x)[axis]);
        most_m = std::max(most_m, (&point.x)[axis]);
      }
    }
    EXPECT_LT(least_m, -0.98 * kRadius_m);
    EXPECT_GT(most_m, 0.98 * kRadius_m);
  }
}

/// The lines of a plane enclose what the plane cuts out of the solid: their area is that of the section.
TEST(SolidOutline, EnclosesTheSectionsOfABall) {
  constexpr double kRadius_m = 0.02;
  const auto solid = solidOf(test::ballBytes(kRadius_m, 0.001));
  for (const OutlineLine& line : outlineOf(solid->grid())) {
    rt::Vec3 twice_area{};
    for (std::size_t i = 1; i < line.size(); ++i) twice_area = twice_area + cross(line[i - 1], line[i]);
    const rt::Vec3 normal = (1 / norm(twice_area)) * twice_area;
    const double height_m = dot(normal, line[0]);
    const double section_m2 = M_PI * (kRadius_m * kRadius_m - height_m * height_m);
    // A chord cuts off chord^2 / (6 radius^2) of its sector: 0.5 % for the diagonal of a cell, 1.45 mm, in
    // the smallest section, whose radius is 0.43 of the ball's.
    EXPECT_NEAR(std::abs(dot(twice_area, normal)) / 2, section_m2, 0.01 * section_m2) << height_m;
  }
}

TEST(SolidOutline, ShowsHolesAndSeparateParts) {
  const auto solid =
      solidOf(test::solidBytes([](const rt::Vec3& p) { return ring(p, 0.02, 0.006); }, 0.034, 0.001));
  const auto lines = outlineOf(solid->grid());
  expectSound(solid->grid(), lines);
  // planes across z cut the ring into two circles, and those across x and y that miss the hole into one line
  EXPECT_GE(lines.size(), 2U * kMaxOutlinePlanes + 2U * kMaxOutlinePlanes);
  const auto inner = std::ranges::count_if(lines, [](const OutlineLine& line) {
    return std::ranges::all_of(line, [](const rt::Vec3& p) { return std::hypot(p.x, p.y) < 0.02; });
  });
  EXPECT_EQ(inner, kMaxOutlinePlanes);
}

TEST(SolidOutline, IsSoundForRandomBodiesAndAtSaddles) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-0.03, 0.03), radius(0.002, 0.012), spacing(0.0012, 0.003);
  for (int i = 0; i < 20; ++i) {
    std::vector<std::pair<rt::Vec3, double>> balls;
    for (int k = 0; k < 6; ++k)
      balls.push_back({{place(random), place(random), place(random)}, radius(random)});
    // two that nearly touch: their sections have saddles
    balls.push_back({{0, 0, 0}, 0.008});
    balls.push_back({{0.0113, 0.0113, 0.001 * (i % 3)}, 0.008});
    const Shape shape = [&](const rt::Vec3& p) {
      double least_m = 1;
      for (const auto& [centre, radius_m] : balls) least_m = std::min(least_m, ball(p, centre, radius_m));
      return least_m;
    };
    const auto solid = solidOf(test::solidBytes(shape, 0.05, spacing(random)));
    const auto lines = outlineOf(solid->grid());
    EXPECT_FALSE(lines.empty());
    expectSound(solid->grid(), lines);
  }
}

TEST(SolidOutline, IsEmptyWhereNothingIsInside) {
  const auto solid = solidOf(test::solidBytes([](const rt::Vec3&) { return 0.01; }, 0.01, 0.001));
  EXPECT_TRUE(outlineOf(solid->grid()).empty());
}

/// A plate as large as a grid may be, with a pattern of holes: coarser cells keep its lines few.
TEST(SolidOutline, StaysSmallForTheLargestAndMostIntricateGrid) {
  rt::DistanceGrid grid;
  grid.samples = {512, 512, 128};
  ASSERT_EQ(grid.size(), rt::kMaxGridCoefficients);
  grid.spacing_m = 0.001;
  grid.scale_m = 1e-5;
  std::vector<std::int16_t> coefficients(grid.size(), std::int16_t{1000});
  for (std::uint32_t z = 60; z < 68; ++z) {
    for (std::uint32_t y = 4; y < 508; ++y) {
      for (std::uint32_t x = 4; x < 508; ++x) {
        const double pattern = std::sin(0.3 * x) + std::sin(0.3 * y);
        coefficients[(std::size_t{z} * 512 + y) * 512 + x] = static_cast<std::int16_t>(-100 + 120 * pattern);
      }
    }
  }
  const Solid solid(grid, std::move(coefficients), {.source = "plate"});
  const auto lines = outlineOf(solid.grid());
  EXPECT_LE(pointsIn(lines), kMaxOutlinePoints);
  EXPECT_GE(pointsIn(lines), kMaxOutlinePoints / 10);
  for (const OutlineLine& line : lines) EXPECT_EQ(line.front(), line.back());
}

/// A body that leaves its samples, which no file may have, has closed lines all the same.
TEST(SolidOutline, EndsAtTheLastSamples) {
  rt::DistanceGrid grid;
  grid.samples = {8, 8, 8};
  grid.spacing_m = 0.001;
  grid.scale_m = 1e-5;
  const Solid solid(grid, std::vector<std::int16_t>(grid.size(), std::int16_t{-50}), {.source = "all"});
  const auto lines = outlineOf(solid.grid());
  EXPECT_FALSE(lines.empty());
  for (const OutlineLine& line : lines) EXPECT_EQ(line.front(), line.back());
}

}  // namespace
}  // namespace hapticd::config
