// SPDX-License-Identifier: Apache-2.0
// Files of solids, of which all that is wrong is refused by name, and the outlines that show where they are.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "config/base/sha256.h"
#include "config/solids/solid_file.h"
#include "config/solids/solid_outline.h"
#include "tests/support/made_solid.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

// As docs/solid-file.md says.
constexpr std::size_t kVersionAt = 8, kHeaderBytesAt = 12, kSamplesAt = 16, kReservedAt = 28, kSpacingAt = 32,
                      kOriginAt = 40, kScaleAt = 64, kErrorAt = 72, kSourceAt = 96, kCoefficientsAt = 160;

template <typename Value>
std::string with(std::string bytes, std::size_t at, Value value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

std::string problemOf(const std::string& bytes) {
  const auto solid = solidFrom(bytes, "a.solid");
  return solid ? "" : solid.error().text();
}

TEST(Sha256, GivesTheExamplesOfItsStandard) {
  EXPECT_EQ(base::sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(base::sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_TRUE(base::isSha256(base::sha256("x")));
  EXPECT_FALSE(base::isSha256(base::sha256("x").substr(1)));
  EXPECT_FALSE(base::isSha256(std::string(64, 'A')));
}

TEST(SolidFile, ReadsBackWhatItWrites) {
  const std::string bytes = test::ballBytes(0.02);
  const auto solid = solidFrom(bytes, "a.solid");
  ASSERT_TRUE(solid) << solid.error().text();
  EXPECT_EQ((*solid)->file(), bytes);
  EXPECT_EQ((*solid)->sha256(), base::sha256(bytes));
  EXPECT_EQ((*solid)->about().source, "made");
  EXPECT_NEAR(distanceAt((*solid)->grid(), {0.023, 0, 0}).distance_m, 0.003, 2e-5);
  EXPECT_NE((*solid)->grid().number, 0U);
  const auto other = solidFrom(test::ballBytes(0.021), "b.solid");
  ASSERT_TRUE(other);
  EXPECT_NE((*solid)->grid().number, (*other)->grid().number);
}

TEST(SolidFile, RefusesByName) {
  const std::string good = test::ballBytes(0.02);
  ASSERT_EQ(problemOf(good), "");
  const std::size_t middle = kCoefficientsAt + (good.size() - kCoefficientsAt) / 4 * 2;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const std::pair<std::string, const char*> cases[] = {
      {"", "is not the file of a solid"},
      {"solid ascii stl", "is not the file of a solid"},
      {good.substr(0, 159), "is not the file of a solid"},
      {with(good, kVersionAt, std::uint32_t{2}), "has version 2"},
      {with(good, kHeaderBytesAt, std::uint32_t{256}), "its header has members"},
      {with(good, kReservedAt, std::uint32_t{1}), "its header has members"},
      {with(good, kSamplesAt, std::uint32_t{3}), "3 samples along axis x are out of range (4..512)"},
      {with(good, kSamplesAt + 8, std::uint32_t{0xffffffff}), "samples along axis z are out of range"},
      {with(good, kSamplesAt, std::uint32_t{512}), "bytes, and its"},
      {good.substr(0, good.size() - 1), "bytes, and its"},
      {good + "x", "bytes, and its"},
      {with(good, kSpacingAt, nan), "a spacing of nan m is out of range"},
      {with(good, kSpacingAt, 0.0), "a spacing of 0 m is out of range"},
      {with(good, kSpacingAt, -0.002), "a spacing of -0.002 m is out of range"},
      {with(good, kSpacingAt, 1e-5), "the coefficients change by more than"},
      {with(good, kScaleAt, infinity), "a scale of inf m is out of range"},
      {with(good, kScaleAt, 1e-3), "the coefficients change by more than"},
      {with(good, kOriginAt + 8, nan), "along axis y it reaches from nan"},
      {with(good, kOriginAt, 11.0), "along axis x it reaches from 11"},
      {with(good, kErrorAt, nan), "an error of nan m is out of range"},
      {with(good, kSourceAt, '\x07'), "is no printable text"},
      {with(good, kSourceAt + 20, 'x'), "is no printable text"},
      {with(good, middle, std::int16_t{32000}), "the coefficients change by more than"},
  };
  for (const auto& [bytes, problem] : cases)
    EXPECT_NE(problemOf(bytes).find(problem), std::string::npos) << problem << ": " << problemOf(bytes);
}

/// A solid that leaves its samples would have a wrong distance outside of them.
TEST(SolidFile, RefusesASolidThatLeavesItsSamples) {
  const std::string bytes = test::solidBytes(
      [](const rt::Vec3& p) {
        return norm(p - rt::Vec3{0.02, 0, 0}) - 0.015;
      },
      0.03, 0.002);
  EXPECT_NE(problemOf(bytes).find("at its border, is a place inside the solid"), std::string::npos)
      << problemOf(bytes);
}

/// A distance has kinks where it is equally far to two places of the boundary; the spline overshoots there.
TEST(SolidFile, AcceptsKinksOfEveryDirection) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 40; ++i) {
    rt::Vec3 axis{normal(random), normal(random), normal(random)};
    axis = (1 / norm(axis)) * axis;
    const double half_m = 0.0031 + 0.0001 * i;
    const auto plate = [&](const rt::Vec3& p) {
      const double along = dot(p, axis);
      const double aside = norm(p - along * axis) - 0.012;
      const double above = std::abs(along) - half_m;
      return std::min(std::max(aside, above), 0.0) + std::hypot(std::max(aside, 0.0), std::max(above, 0.0));
    };
    EXPECT_EQ(problemOf(test::solidBytes(plate, 0.026, 0.0015)), "") << "plate " << i;
  }
}

TEST(SolidFile, SurvivesDamageOfEveryKind) {
  const std::string good = test::ballBytes(0.02, 0.004);
  std::mt19937 random(7);
  const auto below = [&](std::size_t bound) {
    return std::uniform_int_distribution<std::size_t>(0, bound - 1)(random);
  };
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string bytes = good;
    const std::size_t header_only = i % 2 == 0 ? kCoefficientsAt : bytes.size();
    for (std::size_t k = 0; k <= below(4); ++k) bytes[below(header_only)] = static_cast<char>(below(256));
    if (i % 7 == 0) bytes.resize(below(bytes.size()));
    const auto solid = solidFrom(bytes, "a.solid");
    if (!solid) {
      ++refused;
      EXPECT_FALSE(solid.error().remedy.empty());
      continue;
    }
    const rt::GridDistance there = distanceAt((*solid)->grid(), {0.01, -0.02, 0.005});
    EXPECT_TRUE(std::isfinite(there.distance_m));
  }
  EXPECT_GT(refused, 1000);
}

TEST(SolidFile, IsLoadedOnlyUnderItsOwnName) {
  const test::TemporaryFolder folder;
  const std::string bytes = test::ballBytes(0.02);
  const std::string sha256 = base::sha256(bytes);
  folder.write(solidFileName(sha256), bytes);
  EXPECT_TRUE(loadSolid(folder.path(), sha256));
  const std::string other = base::sha256("other");
  folder.write(solidFileName(other), bytes);
  const auto wrong = loadSolid(folder.path(), other);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().what.find("another SHA-256"), std::string::npos);
  EXPECT_FALSE(loadSolid(folder.path(), base::sha256("missing")));
}

// Outlines of solids: closed lines on the boundary, of a bounded size, that show where the solid is.

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
