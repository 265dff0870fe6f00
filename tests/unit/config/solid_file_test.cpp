// SPDX-License-Identifier: Apache-2.0
// Files of solids: what is written is read back, and whatever else is in a file is refused by name.
#include "config/solids/solid_file.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "config/base/sha256.h"
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

}  // namespace
}  // namespace hapticd::config
