// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/block_image.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <cmath>
#include <cstring>

#include "hwy/highway.h"
#include "rt/modelling/block_image.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PixelTag = hn::ScalableTag<std::uint16_t>;

/// Copies `count` pixels from `raw` to `out`. A raw value outside [raw_first, raw_last] has no depth and
/// becomes kNoRawDisparity. Returns true if every pixel has a depth.
bool copyRow(const std::uint16_t* raw, int count, std::uint16_t raw_first, std::uint16_t raw_last,
             std::uint16_t* out) {
  const PixelTag d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto first = hn::Set(d, raw_first);
  const auto last = hn::Set(d, raw_last);
  const auto none = hn::Set(d, kNoRawDisparity);
  bool all = true;
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto value = hn::LoadU(d, raw + i);
    const auto seen = hn::AndNot(hn::Lt(value, first), hn::Not(hn::Lt(last, value)));
    all = all && hn::AllTrue(d, seen);
    hn::StoreU(hn::IfThenElse(seen, value, none), d, out + i);
  }
  for (; i < count; ++i) {
    const bool seen = raw[i] >= raw_first && raw[i] <= raw_last;
    out[i] = seen ? raw[i] : kNoRawDisparity;
    all = all && seen;
  }
  return all;
}

/// Replaces each pixel of `image` that has no measurement by that of `fallback` if its value lies within
/// [first_raw, last_raw].
void fillRow(const std::uint16_t* fallback, int count, std::uint16_t first_raw, std::uint16_t last_raw,
             std::uint16_t* image) {
  const PixelTag d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto none = hn::Set(d, kNoRawDisparity);
  const auto first = hn::Set(d, first_raw);
  const auto last = hn::Set(d, last_raw);
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto value = hn::LoadU(d, image + i);
    const auto other = hn::LoadU(d, fallback + i);
    const auto useless = hn::Or(hn::Lt(other, first), hn::Lt(last, other));
    const auto fills = hn::Not(hn::Or(hn::Lt(value, none), useless));
    hn::StoreU(hn::IfThenElse(fills, other, value), d, image + i);
  }
  for (; i < count; ++i) {
    const bool usable = fallback[i] >= first_raw && fallback[i] <= last_raw;
    if (image[i] >= kNoRawDisparity && usable) image[i] = fallback[i];
  }
}

/// Replaces each pixel of `image` by that of `hidden` where the latter lies within [first_raw, last_raw].
/// Returns true if that changed any pixel.
bool putHiddenRow(const std::uint16_t* hidden, int count, std::uint16_t first_raw, std::uint16_t last_raw,
                  std::uint16_t* image) {
  const PixelTag d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto first = hn::Set(d, first_raw);
  const auto last = hn::Set(d, last_raw);
  bool any = false;
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto value = hn::LoadU(d, hidden + i);
    const auto useless = hn::Or(hn::Lt(value, first), hn::Lt(last, value));
    if (hn::AllTrue(d, useless)) continue;
    const auto before = hn::LoadU(d, image + i);
    any = any || !hn::AllTrue(d, hn::Or(hn::Eq(value, before), useless));
    hn::StoreU(hn::IfThenElse(useless, before, value), d, image + i);
  }
  for (; i < count; ++i) {
    if (hidden[i] < first_raw || hidden[i] > last_raw) continue;
    any = any || image[i] != hidden[i];
    image[i] = hidden[i];
  }
  return any;
}

#if HWY_TARGET == HWY_SCALAR
/// Computes the statistics of `blocks` adjacent blocks. `image` points to the upper left pixel of the first
/// block, inside an image whose rows are `stride` pixels apart.
void sumUpRow(const std::uint16_t* image, int stride, int blocks, BlockRow& out) {
  constexpr int kSide = BlockLattice::kBlock_px;
  const auto stepBetween = [](int a, int b) { return static_cast<std::uint64_t>(std::abs(a - b)); };
  for (int block = 0; block < blocks; ++block) {
    out.sum[block] = out.count[block] = out.largest_step[block] = 0;
    for (int row = 0; row < kSide; ++row) {
      const std::uint16_t* const pixels = image + row * stride + block * kSide;
      for (int column = 0; column < kSide; ++column) {
        const int value = pixels[column];
        if (value < kNoRawDisparity) {
          out.sum[block] += static_cast<std::uint64_t>(value);
          ++out.count[block];
        }
        std::uint64_t& largest = out.largest_step[block];
        if (column > 0) largest = std::max(largest, stepBetween(value, pixels[column - 1]));
        if (row > 0) largest = std::max(largest, stepBetween(value, pixels[column - stride]));
      }
    }
  }
}
#else
using BlockTag = hn::Repartition<std::uint64_t, PixelTag>;

/// Returns the sum of the four 16-bit pixels in each 64-bit lane.
HWY_INLINE hn::Vec<BlockTag> sumPerLane(hn::Vec<PixelTag> pixels) {
  const BlockTag d64;
  const hn::Repartition<std::uint32_t, PixelTag> d32;
  const auto pairs = hn::BitCast(d32, pixels);
  const auto halves = hn::Add(hn::And(pairs, hn::Set(d32, 0xFFFFU)), hn::ShiftRight<16>(pairs));
  const auto wide = hn::BitCast(d64, halves);
  return hn::And(hn::Add(wide, hn::ShiftRight<32>(wide)), hn::Set(d64, 0xFFFFFFFFU));
}

/// Returns the largest of the four 16-bit pixels in each 64-bit lane.
HWY_INLINE hn::Vec<BlockTag> maxPerLane(hn::Vec<PixelTag> pixels) {
  const PixelTag d;
  const BlockTag d64;
  const auto wide = hn::BitCast(d64, pixels);
  const auto pairs = hn::Max(pixels, hn::BitCast(d, hn::ShiftRight<32>(wide)));
  const auto one = hn::Max(pairs, hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(d64, pairs))));
  return hn::And(hn::BitCast(d64, one), hn::Set(d64, 0xFFFFU));
}

HWY_INLINE hn::Vec<PixelTag> stepBetween(hn::Vec<PixelTag> a, hn::Vec<PixelTag> b) {
  return hn::Sub(hn::Max(a, b), hn::Min(a, b));
}

/// Computes the statistics of `blocks` adjacent blocks. `image` points to the upper left pixel of the first
/// block, inside an image whose rows are `stride` pixels apart.
void sumUpRow(const std::uint16_t* image, int stride, int blocks, BlockRow& out) {
  static_assert(BlockLattice::kBlock_px == 4, "a block's row of pixels is one 64-bit lane");
  const PixelTag d;
  const BlockTag d64;
  const auto lanes = static_cast<int>(hn::Lanes(d64));
  const auto none = hn::Set(d, kNoRawDisparity);
  const auto one = hn::Set(d, std::uint16_t{1});
  const auto has_right_neighbour = hn::BitCast(d, hn::Set(d64, 0xFFFFFFFFFFFFU));
  for (int block = 0; block < blocks; block += lanes) {
    auto sum = hn::Zero(d);
    auto count = hn::Zero(d);
    auto largest_step = hn::Zero(d);
    auto above = hn::LoadU(d, image + block * BlockLattice::kBlock_px);
    for (int row = 0; row < BlockLattice::kBlock_px; ++row) {
      const auto value = hn::LoadU(d, image + row * stride + block * BlockLattice::kBlock_px);
      const auto seen = hn::Lt(value, none);
      sum = hn::Add(sum, hn::IfThenElseZero(seen, value));
      count = hn::Add(count, hn::IfThenElseZero(seen, one));
      const auto right = hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(d64, value)));
      const auto across = hn::And(stepBetween(value, right), has_right_neighbour);
      largest_step = hn::Max(largest_step, hn::Max(across, stepBetween(value, above)));
      above = value;
    }
    hn::StoreU(sumPerLane(sum), d64, out.sum + block);
    hn::StoreU(sumPerLane(count), d64, out.count + block);
    hn::StoreU(maxPerLane(largest_step), d64, out.largest_step + block);
  }
}
#endif

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(copyRow);
HWY_EXPORT(fillRow);
HWY_EXPORT(putHiddenRow);
HWY_EXPORT(sumUpRow);

namespace {

/// Consecutive pixels [begin, end) of a row that have no measurement.
struct Gap {
  int begin;
  int end;
};

/// Fills a gap by linear interpolation between its two neighbours, if their difference is within `limits`.
void closeGap(std::uint16_t* row, Gap gap, const GapLimits& limits) noexcept {
  const float before = row[gap.begin - 1];
  const float change = static_cast<float>(row[gap.end]) - before;
  const auto length = static_cast<float>(gap.end - gap.begin);
  if (std::abs(change) > limits.max_raw + limits.max_raw_per_px * length) return;
  for (int i = gap.begin; i < gap.end; ++i) {
    const float share = static_cast<float>(i - gap.begin + 1) / (length + 1);
    row[i] = static_cast<std::uint16_t>(before + share * change + 0.5F);
  }
}

/// Closes the gaps of one image row within the columns [first, last]. `row` points to column 0; an image has
/// `width` columns.
void closeGaps(std::uint16_t* row, int width, int first, int last, const GapLimits& limits) noexcept {
  for (int column = first; column <= last; ++column) {
    if (row[column] < kNoRawDisparity) continue;
    Gap gap{column, column};
    while (gap.end <= last && row[gap.end] >= kNoRawDisparity) ++gap.end;
    column = gap.end;
    if (gap.end - gap.begin > limits.longest_px) continue;
    if (gap.begin == 0 || gap.end == width) {
      std::fill(row + gap.begin, row + gap.end, SurfaceLayer::kBeyondView);
    } else if (gap.begin > first && gap.end <= last) {
      closeGap(row, gap, limits);
    }
  }
}

/// One bit for each pixel of a block, row by row.
using BlockBits = std::uint32_t;

/// Spreads `bits` to linked neighbours. A bit set in `links` means that its pixel and the one `step` bits
/// further on belong to the same surface.
BlockBits grown(BlockBits bits, BlockBits links, int step) noexcept {
  return bits | ((bits & links) << step) | ((bits >> step) & links);
}

/// Returns the mean raw value of the nearest surface in a block that shows more than one: the pixels
/// connected to the nearest pixel by differences of at most `max_step`. Returns -1 if these are too few.
float meanOfNearest(const std::uint16_t* pixels, int stride, int max_step) noexcept {
  constexpr int kMin = 3;
  constexpr int kSide = BlockLattice::kBlock_px;
  int values[kSide * kSide];
  int nearest = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    values[i] = pixels[i / kSide * stride + i % kSide];
    if (values[i] < values[nearest]) nearest = i;
  }
  BlockBits to_right = 0;
  BlockBits to_below = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    if (values[i] >= kNoRawDisparity) continue;
    const auto isLinkedTo = [&](int other) {
      return values[other] < kNoRawDisparity && std::abs(values[other] - values[i]) <= max_step;
    };
    if (i % kSide + 1 < kSide && isLinkedTo(i + 1)) to_right |= 1U << i;
    if (i / kSide + 1 < kSide && isLinkedTo(i + kSide)) to_below |= 1U << i;
  }
  BlockBits surface = 1U << nearest;
  for (BlockBits before = 0; before != surface;) {
    before = surface;
    surface = grown(grown(surface, to_right, 1), to_below, kSide);
  }
  int sum = 0;
  int count = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int counts = static_cast<int>(surface >> i & 1U);
    sum += counts * values[i];
    count += counts;
  }
  return count >= kMin ? static_cast<float>(sum) / static_cast<float>(count) : -1;
}

}  // namespace

void copyClosingGaps(const std::uint16_t* raw, const std::uint16_t* fallback, const ImageLayout& layout,
                     const PixelWindow& window, const GapLimits& limits, std::uint16_t* image) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = layout.at(row, window.column_first);
    const bool all =
        HWY_DYNAMIC_DISPATCH(copyRow)(raw + first, columns, limits.raw_first, limits.raw_last, image + first);
    if (all) continue;
    closeGaps(image + layout.at(row, 0), layout.width_px, window.column_first, window.column_last, limits);
    if (fallback == nullptr) continue;
    HWY_DYNAMIC_DISPATCH(fillRow)
    (fallback + first, columns, limits.remembered_first, limits.remembered_last, image + first);
  }
}

bool insertHidden(const std::uint16_t* hidden, const ImageLayout& layout, const PixelWindow& window,
                  const GapLimits& limits, std::uint16_t* image) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  bool any = false;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = layout.at(row, window.column_first);
    any = HWY_DYNAMIC_DISPATCH(putHiddenRow)(hidden + first, columns, limits.remembered_first,
                                             limits.remembered_last, image + first) ||
          any;
  }
  return any;
}

void sumUpBlocks(const std::uint16_t* image, const ImageLayout& layout, const BlockLattice& lattice,
                 const BlockWindow& blocks, int max_step, const BlockSums& sums) noexcept {
  constexpr int kSide = BlockLattice::kBlock_px;
  BlockRow line;
  for (int row = blocks.row_first; row <= blocks.row_last; ++row) {
    const std::uint16_t* const pixels = image + layout.at(row * kSide, blocks.column_first * kSide);
    HWY_DYNAMIC_DISPATCH(sumUpRow)(pixels, layout.stride_px, blocks.columns(), line);
    const std::size_t first = lattice.at(row, blocks.column_first);
    for (int i = 0; i < blocks.columns(); ++i) {
      float& disparity = sums.disparity[first + static_cast<std::size_t>(i)];
      const bool full =
          line.count[i] == kSide * kSide && line.largest_step[i] <= static_cast<std::uint64_t>(max_step);
      sums.is_full[first + static_cast<std::size_t>(i)] = full ? 1 : 0;
      if (full) {
        disparity = static_cast<float>(line.sum[i]) / (kSide * kSide);
      } else {
        disparity = line.count[i] == 0 ? -1 : meanOfNearest(pixels + i * kSide, layout.stride_px, max_step);
      }
    }
  }
}

}  // namespace hapticd::rt
#endif
