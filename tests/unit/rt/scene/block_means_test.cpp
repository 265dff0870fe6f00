// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/surface/block_means.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "rt/depth/depth_frame.h"
#include "rt/modelling/surface/column_shift_kernel.h"
#include "tests/unit/rt/simd_targets.h"

// The oracles follow the rules block by block.
namespace hapticd::test {
namespace {

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
        .moved_raw = 0.75F,
        .farthest_raw = 9};
    std::vector<OneMean> expected;
    double sum = 0;
    int count = 0;
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
            const float from = moves ? mean.disparity + update.moved_raw : mean.disparity;
            const float innovation = now - from;
            if (moves && std::abs(innovation) <= update.farthest_raw) {
              sum += static_cast<double>(innovation);
              ++count;
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
    rt::Innovations innovations{.sum_raw = 1, .count = 2};
    rt::followBlocks(lattice_, window_, observed.data(), offset.data(), update, means, innovations);
    for (std::size_t block = 0; block < lattice_.blocks(); ++block) {
      ASSERT_EQ(meanAt(means, block), expected[block]) << "block " << block;
    }
    // The terms are multiples of 2^-15 and their sum is below 2^15, so no order of them rounds.
    EXPECT_EQ(innovations.sum_raw, 1 + sum);
    EXPECT_EQ(innovations.count, 2 + count);
    EXPECT_EQ(count > 0, before != 0);
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

}  // namespace
}  // namespace hapticd::test
