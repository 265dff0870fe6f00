// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/modelling/surface/block_image.h"
#include "rt/modelling/surface/block_sums.h"
#include "tests/unit/rt/simd_targets.h"

// The oracle follows the rules of fillLayerImages() and sumUpBlocks() pixel by pixel, without vectors and
// bits.
namespace hapticd::test {
namespace {

using rt::kNoRawDisparity;
using rt::SurfaceLayer;
using Image = std::vector<std::uint16_t>;

constexpr int kWidth = drivers::kKinectWidth;
constexpr int kRows = 24;
constexpr int kSide = rt::BlockLattice::kBlock_px;
constexpr std::uint16_t kUntouched = 7;

constexpr rt::GapLimits kLimits{.raw_first = 100,
                                .raw_last = 1000,
                                .remembered_first = 300,
                                .remembered_last = 900,
                                .longest_px = 12,
                                .max_raw = 6,
                                .max_raw_per_px = 0.5F};

bool isIn(int raw, int first, int last) {
  return raw >= first && raw <= last;
}

/// Closes the gaps between the columns `first` and `last` of a row in which kNoRawDisparity is missing.
void closeGaps(std::uint16_t* row, int first, int last) {
  for (int begin = first; begin <= last; ++begin) {
    if (row[begin] != kNoRawDisparity) continue;
    int end = begin;
    while (end <= last && row[end] == kNoRawDisparity) ++end;
    const int length = end - begin;
    if (length <= kLimits.longest_px) {
      if (begin == 0 || end == kWidth) {
        std::fill(row + begin, row + end, SurfaceLayer::kBeyondView);
      } else if (begin > first && end <= last) {
        const int change = row[end] - row[begin - 1];
        if (static_cast<float>(std::abs(change)) <=
            kLimits.max_raw + kLimits.max_raw_per_px * static_cast<float>(length)) {
          for (int i = begin; i < end; ++i) {
            const float share = static_cast<float>(i - begin + 1) / (static_cast<float>(length) + 1);
            row[i] = static_cast<std::uint16_t>(row[begin - 1] + share * static_cast<float>(change) + 0.5F);
          }
        }
      }
    }
    begin = end;
  }
}

void copyMeasured(const std::uint16_t* from, int first, int last, std::uint16_t* to) {
  for (int i = first; i <= last; ++i) {
    to[i] = isIn(from[i], kLimits.raw_first, kLimits.raw_last) ? from[i] : kNoRawDisparity;
  }
}

/// Both images by the rules; `remembered` may be empty. Returns whether they differ.
bool fillByRules(const Image& raw, const Image& remembered, const rt::PixelWindow& window, Image& visible,
                 Image& hidden) {
  bool differ = false;
  const int first = window.column_first;
  const int last = window.column_last;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    std::uint16_t* const seen = &visible[static_cast<std::size_t>(row * kWidth)];
    copyMeasured(&raw[static_cast<std::size_t>(row * kWidth)], first, last, seen);
    closeGaps(seen, first, last);
    if (remembered.empty()) continue;
    const std::uint16_t* const known = &remembered[static_cast<std::size_t>(row * kWidth)];
    const std::uint16_t* const measured = &raw[static_cast<std::size_t>(row * kWidth)];
    std::uint16_t* const behind = &hidden[static_cast<std::size_t>(row * kWidth)];
    const auto isKnown = [known](int i) {
      return isIn(known[i], kLimits.remembered_first, kLimits.remembered_last);
    };
    for (int i = first; i <= last; ++i) {
      if (seen[i] >= kNoRawDisparity && isKnown(i)) seen[i] = known[i];
    }
    copyMeasured(seen, first, last, behind);
    closeGaps(behind, first, last);
    for (int i = first; i <= last; ++i) {
      const bool flickers = !isIn(measured[i], kLimits.raw_first, kLimits.raw_last) &&
                            std::abs(behind[i] - known[i]) <= kLimits.same_raw();
      if (!isKnown(i) || flickers) continue;
      differ = differ || behind[i] != known[i];
      behind[i] = known[i];
    }
  }
  return differ;
}

class LayerImages : public EachSimdTarget {
 protected:
  static Image imageOf(std::uint16_t value) { return Image(kWidth * kRows + rt::kVectorPadding, value); }

  /// A surface with steps, gaps of all lengths, and values outside all limits.
  Image flickering() {
    Image image = imageOf(0);
    int raw = 500;
    int gap = 0;
    for (std::uint16_t& pixel : image) {
      if (upTo(60) == 0) raw = 50 + upTo(1000);
      if (gap == 0 && upTo(12) == 0) gap = 1 + upTo(upTo(4) == 0 ? 30 : 4);
      const bool missing = gap > 0;
      if (missing) --gap;
      pixel = static_cast<std::uint16_t>(missing ? 2047 : raw + upTo(4));
    }
    return image;
  }
  /// Values at some pixels.
  Image sparse() {
    Image image = imageOf(kNoRawDisparity);
    for (std::uint16_t& pixel : image) {
      if (upTo(3) == 0) pixel = static_cast<std::uint16_t>(280 + upTo(650));
    }
    return image;
  }
  rt::PixelWindow anyWindow() {
    const int column_first = upTo(4) == 0 ? 0 : kSide * upTo(kWidth / kSide - 1);
    const int columns = upTo(4) == 0 ? kWidth : kSide * (1 + upTo(60));
    return {.column_first = column_first,
            .column_last = std::min(kWidth, column_first + columns) - 1,
            .row_first = upTo(5),
            .row_last = kRows - 1 - upTo(5)};
  }
  int upTo(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  rt::ImageLayout layout_{rt::DepthModel(rt::DepthModelParameters{}, {})};

 private:
  std::mt19937 random_{1};
};

TEST_P(LayerImages, FollowTheRulesPixelByPixelAndLeaveTheRestAlone) {
  for (int round = 0; round < 100; ++round) {
    const Image raw = flickering();
    const Image remembered = round % 3 == 0 ? Image() : sparse();
    const rt::PixelWindow window = anyWindow();
    Image visible = imageOf(kUntouched);
    Image hidden = imageOf(kUntouched);
    Image expected_visible = visible;
    Image expected_hidden = hidden;
    const bool differ = rt::fillLayerImages({.raw = raw.data(),
                                             .remembered = remembered.empty() ? nullptr : remembered.data(),
                                             .visible = visible.data(),
                                             .hidden = hidden.data()},
                                            layout_, window, kLimits);
    EXPECT_EQ(differ, fillByRules(raw, remembered, window, expected_visible, expected_hidden));
    ASSERT_EQ(visible, expected_visible) << "round " << round;
    ASSERT_EQ(hidden, expected_hidden) << "round " << round;
  }
}

TEST_P(LayerImages, AreTheSameWhereWhatIsRememberedIsSeen) {
  const Image raw = imageOf(500);
  Image visible = imageOf(0);
  Image hidden = imageOf(0);
  const rt::PixelWindow window{.column_first = 8, .column_last = 99, .row_first = 0, .row_last = 3};
  EXPECT_FALSE(rt::fillLayerImages(
      {.raw = raw.data(), .remembered = raw.data(), .visible = visible.data(), .hidden = hidden.data()},
      layout_, window, kLimits));
}

TEST_P(LayerImages, GiveFullBlocksTheirMeanAndOthersThatOfTheNearestSurface) {
  constexpr int kMaxStep = 3;
  const rt::BlockLattice lattice(rt::DepthModel(rt::DepthModelParameters{}, {}));
  std::vector<float> disparity(lattice.blocks() + rt::kVectorPadding);
  std::vector<std::uint8_t> is_full(lattice.blocks() + rt::kVectorPadding);
  const rt::BlockWindow blocks{.column_first = 2, .column_last = 40, .row_first = 1, .row_last = 3};
  Image image = imageOf(500);
  const auto pixelOf = [&](int row, int block, int column) -> std::uint16_t& {
    return image[static_cast<std::size_t>(row * kWidth + block * kSide + column)];
  };
  pixelOf(6, 10, 1) = 502;              // noise
  pixelOf(6, 11, 1) = kNoRawDisparity;  // a hole
  for (int row = 4; row < 8; ++row) {
    pixelOf(row, 12, 0) = pixelOf(row, 12, 1) = 440;                                  // something nearer
    for (int i = 0; i < kSide; ++i) pixelOf(row, 13, i) = SurfaceLayer::kBeyondView;  // nothing
  }
  rt::sumUpBlocks(image.data(), layout_, lattice, blocks, kMaxStep, {disparity.data(), is_full.data()});
  for (int row = blocks.row_first; row <= blocks.row_last; ++row) {
    for (int column = blocks.column_first; column <= blocks.column_last; ++column) {
      const std::size_t block = lattice.at(row, column);
      const int special = row == 1 ? column : 0;
      EXPECT_EQ(disparity[block], special == 10 ? 500.125F : special == 12 ? 440 : special == 13 ? -1 : 500);
      EXPECT_EQ(is_full[block], special >= 11 && special <= 13 ? 0 : 1) << row << ' ' << column;
    }
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(LayerImages);

}  // namespace
}  // namespace hapticd::test
