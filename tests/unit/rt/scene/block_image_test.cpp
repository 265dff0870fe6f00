// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_frame.h"
#include "rt/modelling/surface/block_image.h"
#include "rt/modelling/surface/block_means.h"
#include "rt/modelling/surface/block_sums.h"
#include "rt/modelling/surface/column_shift_kernel.h"
#include "tests/unit/rt/simd_targets.h"

namespace hapticd::test {
namespace {

using Image = std::vector<std::uint16_t>;
using rt::kNoRawDisparity;
using rt::SurfaceLayer;

// The oracles follow the rules block by block.

constexpr std::uint32_t kBefore = 41;
constexpr std::uint32_t kNow = 42;
constexpr std::uint32_t kLongAgo = 7;

struct OneMean {
  float disparity;
  float frames;
  std::uint32_t updated;
  friend bool operator==(const OneMean&, const OneMean&) = default;
};

OneMean meanAt(const rt::BlockMeans& means, std::size_t block) {
  return {means.disparity[block], means.frames[block], means.updated[block]};
}

void setMean(rt::BlockMeans& means, std::size_t block, const OneMean& mean) {
  means.disparity[block] = mean.disparity;
  means.frames[block] = mean.frames;
  means.updated[block] = mean.updated;
}

class BlockMeans : public EachSimdTarget {
 protected:
  BlockMeans() : lattice_(rt::DepthModel(rt::DepthModelParameters{}, {})) {}

  OneMean anyMean() {
    constexpr std::uint32_t kFrames[] = {kBefore, kBefore, kBefore, kNow, kLongAgo, 0};
    return {upTo(6) == 0 ? -1.0F : near500(), static_cast<float>(1 + upTo(16)), kFrames[upTo(6)]};
  }
  static void add(rt::Innovations& sums, double innovation, int column, int row) {
    sums.raw += innovation;
    sums.raw_column += innovation * column;
    sums.raw_row += innovation * row;
    sums.count += 1;
    sums.column += column;
    sums.row += row;
    sums.column_column += column * column;
    sums.column_row += column * row;
    sums.row_row += row * row;
  }
  float near500() { return 500 + static_cast<float>(upTo(4096)) / 256; }
  int upTo(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  rt::BlockLattice lattice_;
  rt::BlockWindow window_{.column_first = 5, .column_last = 48, .row_first = 3, .row_last = 30};
  std::mt19937 random_{1};
};

TEST_P(BlockMeans, FollowObservationsBlockByBlock) {
  std::vector<float> observed(lattice_.blocks() + rt::kVectorPadding);
  std::vector<float> offset(rt::BlockLattice::kMaxColumns + rt::kVectorPadding);
  for (const std::uint32_t before : {kBefore, 0U}) {
    rt::BlockMeans means(lattice_);
    for (std::size_t block = 0; block < lattice_.blocks(); ++block) {
      setMean(means, block, anyMean());
      observed[block] = upTo(6) == 0 ? -1.0F : near500();
    }
    for (float& value : offset) value = static_cast<float>(upTo(3) - 1);
    const rt::MeansUpdate update{
        .sequence = kNow,
        .before = before,
        .max_frames = 8,
        .most_raw = 4,
        .region = {.blocks = {10, 31, 8, 20}, .disparity_least = 502, .disparity_greatest = 512},
        .moved_raw = {.first = 0.75F, .per_column = 0.0625F, .per_row = -0.125F},
        .farthest_raw = 9};
    std::vector<OneMean> expected;
    rt::Innovations sums{.raw = 1,
                         .raw_column = 2,
                         .raw_row = 3,
                         .count = 4,
                         .column = 5,
                         .row = 6,
                         .column_column = 7,
                         .column_row = 8,
                         .row_row = 9};
    rt::Innovations innovations = sums;
    for (int row = 0; row < lattice_.rows; ++row) {
      for (int column = 0; column < lattice_.columns; ++column) {
        const std::size_t block = lattice_.at(row, column);
        OneMean mean = meanAt(means, block);
        const bool is_inside = row >= window_.row_first && row <= window_.row_last &&
                               column >= window_.column_first && column <= window_.column_last;
        if (is_inside && mean.updated != kNow) {
          const bool known = before != 0 && mean.updated == before && mean.disparity >= 0;
          const float now = observed[block] < 0 ? observed[block]
                                                : observed[block] - offset[static_cast<std::size_t>(column)];
          if (known && now >= 0) {
            const bool moves = row >= 8 && row <= 20 && column >= 10 && column <= 31 &&
                               mean.disparity >= 502 && mean.disparity <= 512;
            const auto c = static_cast<float>(column);
            const auto r = static_cast<float>(row);
            const float moved = 0.75F + 0.0625F * c - 0.125F * r;
            const float from = moves ? mean.disparity + moved : mean.disparity;
            const float innovation = now - from;
            if (moves && std::abs(innovation) <= update.farthest_raw) {
              add(sums, static_cast<double>(innovation), column, row);
            }
            const bool same = std::abs(innovation) <= update.most_raw;
            const float frames = same ? std::min(mean.frames + 1, update.max_frames) : 1;
            mean = {from + innovation / frames, frames, kNow};
          } else {
            mean = {now, 1, kNow};
          }
        }
        expected.push_back(mean);
      }
    }
    rt::followBlocks(lattice_, window_, observed.data(), offset.data(), update, means, innovations);
    for (std::size_t block = 0; block < lattice_.blocks(); ++block) {
      ASSERT_EQ(meanAt(means, block), expected[block]) << "block " << block;
    }
    // The terms are multiples of 2^-15 and their sums are below 2^30, so no order of them rounds.
    EXPECT_EQ(innovations.raw, sums.raw);
    EXPECT_EQ(innovations.raw_column, sums.raw_column);
    EXPECT_EQ(innovations.raw_row, sums.raw_row);
    EXPECT_EQ(innovations.count, sums.count);
    EXPECT_EQ(innovations.column, sums.column);
    EXPECT_EQ(innovations.row, sums.row);
    EXPECT_EQ(innovations.column_column, sums.column_column);
    EXPECT_EQ(innovations.column_row, sums.column_row);
    EXPECT_EQ(innovations.row_row, sums.row_row);
    EXPECT_EQ(sums.count > 4, before != 0);
  }
}

TEST_P(BlockMeans, ContinueOthersOnlyWhereTheyHaveNoneOfTheirOwn) {
  rt::BlockMeans from(lattice_);
  rt::BlockMeans to(lattice_);
  std::vector<OneMean> expected;
  for (int row = 0; row < lattice_.rows; ++row) {
    for (int column = 0; column < lattice_.columns; ++column) {
      const std::size_t block = lattice_.at(row, column);
      setMean(from, block, anyMean());
      setMean(to, block, anyMean());
      const bool is_inside = row >= window_.row_first && row <= window_.row_last &&
                             column >= window_.column_first && column <= window_.column_last;
      const bool takes = is_inside && from.updated[block] == kBefore && to.updated[block] != kBefore &&
                         to.updated[block] != kNow;
      expected.push_back(meanAt(takes ? from : to, block));
    }
  }
  rt::continueBlocks(lattice_, window_, kBefore, kNow, from, to);
  for (std::size_t block = 0; block < lattice_.blocks(); ++block) {
    ASSERT_EQ(meanAt(to, block), expected[block]) << "block " << block;
  }
}

TEST_P(BlockMeans, SumUpDifferencesOfTheSameSurfaceByColumn) {
  constexpr int kColumns = 3 * rt::kRowAlignment_px;
  constexpr int kRows = 24;
  constexpr int kApart = 5;
  std::vector<std::uint16_t> now(kColumns * kRows * kApart);
  std::vector<std::uint16_t> before(kColumns * kRows);
  const auto any = [this] { return static_cast<std::uint16_t>(upTo(8) == 0 ? 2047 : 500 + upTo(6)); };
  std::generate(now.begin(), now.end(), any);
  std::generate(before.begin(), before.end(), any);
  const std::vector<std::uint16_t> old = before;
  std::vector<std::int16_t> sum(kColumns);
  std::vector<std::int16_t> count(kColumns);
  rt::sumUpDifferences({.now = now.data(),
                        .now_stride_px = kColumns * kApart,
                        .before = before.data(),
                        .before_stride_px = kColumns,
                        .rows = kRows,
                        .columns = kColumns,
                        .last_raw = 2046,
                        .max_difference_raw = 3},
                       sum.data(), count.data());
  for (std::size_t column = 0; column < kColumns; ++column) {
    int expected_sum = 0;
    int expected_count = 0;
    for (std::size_t row = 0; row < kRows; ++row) {
      const int value = now[row * kColumns * kApart + column];
      const int difference = value - old[row * kColumns + column];
      EXPECT_EQ(before[row * kColumns + column], value);
      if (value > 2046 || old[row * kColumns + column] > 2046 || std::abs(difference) > 3) continue;
      expected_sum += difference;
      ++expected_count;
    }
    EXPECT_EQ(sum[column], expected_sum);
    EXPECT_EQ(count[column], expected_count);
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(BlockMeans);

// The oracle follows the rules of fillLayerImages() and sumUpBlocks() pixel by pixel, without vectors and
// bits.

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
