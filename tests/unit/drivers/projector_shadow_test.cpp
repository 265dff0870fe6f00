// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/projector_shadow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "drivers/camera/synthetic/nothing_seen.h"

namespace hapticd::drivers {
namespace {

constexpr double kPixelsPerRaw = 0.137;

/// A body in columns 200 to 299 that is 100 raw units nearer than a wall.
std::vector<float> bodyBeforeAWall() {
  std::vector<float> row(640, 800);
  std::fill(row.begin() + 200, row.begin() + 300, 700.0F);
  return row;
}

std::vector<int> missing(const std::vector<float>& row) {
  std::vector<int> columns;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (row[i] < 0) columns.push_back(static_cast<int>(i));
  }
  return columns;
}

/// Returns first, first + 1 .. last.
std::vector<int> columns(int first, int last) {
  std::vector<int> all;
  for (int column = first; column <= last; ++column) all.push_back(column);
  return all;
}

// 44.6 px m (1/Z_n - 1/Z_f) = 0.137 px * 100 = 13.7 px from the body's last column on: 13 whole pixels.
TEST(ProjectorShadow, HidesTheStripOfTheWallBesideTheBodyOppositeToTheProjector) {
  const std::pair<ShadowSide, std::vector<int>> cases[] = {
      {ShadowSide::right, columns(300, 312)}, {ShadowSide::left, columns(187, 199)}, {ShadowSide::none, {}}};
  for (const auto& [side, hidden] : cases) {
    auto row = bodyBeforeAWall();
    removeShadow(row, side, kPixelsPerRaw);
    EXPECT_EQ(missing(row), hidden);
  }
}

TEST(ProjectorShadow, CoversASurfaceThatIsSteeperThanTheLineToTheProjectorAndNoOther) {
  std::vector<float> gentle;
  std::vector<float> steep;
  for (int column = 0; column < 640; ++column) {
    gentle.push_back(500.0F + 7.0F * static_cast<float>(column));  // 0.96 px of shift per pixel
    steep.push_back(500.0F + 7.6F * static_cast<float>(column));   // 1.04
  }
  auto falling = steep;
  std::ranges::reverse(falling);
  removeShadow(gentle, ShadowSide::right, kPixelsPerRaw);
  removeShadow(steep, ShadowSide::right, kPixelsPerRaw);
  removeShadow(falling, ShadowSide::right, kPixelsPerRaw);
  EXPECT_TRUE(missing(gentle).empty());
  EXPECT_EQ(missing(steep), columns(1, 639));
  EXPECT_TRUE(missing(falling).empty());
}

TEST(ProjectorShadow, IsNotCastByWhatIsNotSeen) {
  std::vector<float> row(640, 800);
  std::fill(row.begin() + 200, row.begin() + 300, kNothingSeen);
  removeShadow(row, ShadowSide::right, kPixelsPerRaw);
  EXPECT_EQ(missing(row), columns(200, 299));
}

}  // namespace
}  // namespace hapticd::drivers
