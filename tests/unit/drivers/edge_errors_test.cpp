// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "config/settings/depth_cameras.h"
#include "drivers/camera/synthetic/edge_errors.h"

namespace hapticd::drivers {
namespace {

constexpr double kPixelsPerRaw = 0.137;

/// A body in columns 200 to 299 that is 100 raw units nearer than a wall.
std::vector<float> rowWithABody() {
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
    auto row = rowWithABody();
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

using Image = std::vector<float>;

constexpr int kWidth = 320;
constexpr int kHeight = 400;
constexpr int kFirst = 100;  // columns of the body
constexpr int kLast = 199;
constexpr float kNear_m = 0.5F;
constexpr float kFar_m = 1.0F;
// f = 160 px for a view of 90 degrees; f b (1/0.5 - 1/1) and f b / 1 are 8.4 px
constexpr double kBaseline_m = 0.0525;
constexpr int kBand = 8;
constexpr int kMaxWider = 2;  // half of a window of 5 pixels
// Five standard errors; the seed is fixed.
constexpr double kStandardErrors = 5;

rt::DepthModelParameters stereo() {
  return config::stereoCamera({kWidth, kHeight}, 90, kBaseline_m);
}

/// A body that reaches from the top to the bottom of the image, in front of a wall.
Image bodyBeforeAWall(float near_m = kNear_m) {
  Image depths_m;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const int column = i % kWidth;
    depths_m.push_back(column >= kFirst && column <= kLast ? near_m : kFar_m);
  }
  return depths_m;
}

Image withErrors(const rt::DepthModelParameters& camera, Image depths_m, std::uint32_t seed = 1) {
  EdgeErrors(camera, kBaseline_m, seed).applyTo(depths_m);
  return depths_m;
}

float at(const Image& image, int column, int row) {
  return image[static_cast<std::size_t>(row * kWidth + column)];
}

TEST(EdgeErrors, AStereoCameraMeasuresNothingThatItsRightImagerDoesNotSee) {
  const Image image = withErrors(stereo(), bodyBeforeAWall());
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const bool in_band = column >= kFirst - kBand && column < kFirst - kMaxWider;
      const bool in_border = column < kBand;
      const bool widened = column >= kFirst - kMaxWider && column < kFirst;  // may be covered by the body
      if (widened) continue;
      ASSERT_EQ(at(image, column, row) == kNothingSeen, in_band || in_border) << column;
    }
  }
}

TEST(EdgeErrors, AStereoCameraSeesABodyWiderByUpToHalfAWindow) {
  const Image image = withErrors(stereo(), bodyBeforeAWall());
  double wider = 0;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = kFirst; column <= kLast; ++column) ASSERT_EQ(at(image, column, row), kNear_m);
    for (int k = 1; k <= kMaxWider; ++k) {
      wider += at(image, kFirst - k, row) == kNear_m ? 1 : 0;
      wider += at(image, kLast + k, row) == kNear_m ? 1 : 0;
    }
    ASSERT_EQ(at(image, kLast + kMaxWider + 1, row), kFar_m);
  }
  // 0, 1 or 2 pixels: those beside the body in 2 of 3 rows, those beyond in 1 of 3, each with variance 2/9
  EXPECT_NEAR(wider / (2 * kHeight), 1, kStandardErrors * std::sqrt(2 * 2.0 / 9 / (2 * kHeight)));
}

TEST(EdgeErrors, HalfOfTheTimeOfFlightPixelsAtAnEdgeFly) {
  const Image image = withErrors(config::timeOfFlightCamera({kWidth, kHeight}), bodyBeforeAWall());
  double flying = 0;
  double shares = 0;
  for (int row = 0; row < kHeight; ++row) {
    for (const int column : {kFirst - 1, kFirst, kLast, kLast + 1}) {
      const bool is_body = column == kFirst || column == kLast;
      const double share =
          std::abs(at(image, column, row) - (is_body ? kNear_m : kFar_m)) / (kFar_m - kNear_m);
      ASSERT_LE(share, 0.5);
      flying += share > 0 ? 1 : 0;
      shares += share;
    }
    for (const int column : {kFirst - 2, kFirst + 1, kLast - 1, kLast + 2})
      ASSERT_EQ(at(image, column, row), bodyBeforeAWall()[static_cast<std::size_t>(column)]);
  }
  const double pixels = 4 * kHeight;
  EXPECT_NEAR(flying / pixels, 0.5, kStandardErrors * std::sqrt(0.25 / pixels));
  // uniform from 0 to 1/2, with variance 1/48
  EXPECT_NEAR(shares / flying, 0.25, kStandardErrors * std::sqrt(1.0 / 48 / flying));
}

TEST(EdgeErrors, SmallStepsAndSteepPlanesAreNoEdges) {
  const rt::DepthModelParameters flight = config::timeOfFlightCamera({640, kHeight});
  Image plane_m;
  for (int row = 0; row < kHeight; ++row) {
    const double up = (flight.cy_px - row) / flight.fy_px;
    const double inverse = 1 + up * std::tan(1.4);
    plane_m.insert(plane_m.end(), 640, inverse > 0.8 ? static_cast<float>(1 / inverse) : kNothingSeen);
  }
  Image image = plane_m;
  EdgeErrors(flight, kBaseline_m, 1).applyTo(image);
  EXPECT_EQ(image, plane_m);

  const Image step = bodyBeforeAWall(0.985F);
  EXPECT_EQ(withErrors(config::timeOfFlightCamera({kWidth, kHeight}), step), step);
  const Image in_stereo = withErrors(stereo(), step);
  EXPECT_EQ(at(in_stereo, kLast + 1, 5), kFar_m);
}

// Whatever lies behind the body, nothing is seen there; so nothing is hidden or mixed.
TEST(EdgeErrors, LeaveABodyBeforeNothingAsItIs) {
  for (const rt::DepthModelParameters& camera : {stereo(), config::timeOfFlightCamera({kWidth, kHeight})}) {
    Image alone = bodyBeforeAWall();
    for (float& depth_m : alone) depth_m = depth_m == kFar_m ? kNothingSeen : depth_m;
    EXPECT_EQ(withErrors(camera, alone), alone);
  }
}

// A surface that recedes to the left by more than the right imager's line of sight hides itself.
TEST(RemoveUnmatchedIn, RemovesWhatIsSteeperThanTheLineOfSight) {
  for (const double disparity_per_px : {0.5, 0.99, 1.01}) {
    std::vector<float> row_m(200, kNothingSeen);
    constexpr double kFocalBaseline_px_m = 10;
    for (std::size_t i = 0; i < 100; ++i) {
      const double disparity_px = 12 + disparity_per_px * static_cast<double>(i);
      row_m[100 + i] = static_cast<float>(kFocalBaseline_px_m / disparity_px);
    }
    removeUnmatchedIn(row_m, kFocalBaseline_px_m);
    const bool hides_itself = disparity_per_px > 1;
    EXPECT_EQ(row_m[150] == kNothingSeen, hides_itself) << disparity_per_px;
    EXPECT_GT(row_m[199], 0);
  }
}

}  // namespace
}  // namespace hapticd::drivers
