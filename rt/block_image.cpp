#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/block_image.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <cmath>
#include <cstring>

#include "hwy/highway.h"
#include "rt/block_image.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PixelTag = hn::ScalableTag<std::uint16_t>;

/// Copies pixels, those without a depth as kRawNoMeasurement or from `fallback`; true if all have one then.
bool copyRow(const std::uint16_t* raw, const std::uint16_t* fallback, int count, std::uint16_t raw_first,
             std::uint16_t raw_last, std::uint16_t* out) {
  const PixelTag d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto first = hn::Set(d, raw_first);
  const auto last = hn::Set(d, raw_last);
  const auto none = hn::Set(d, kRawNoMeasurement);
  bool all = true;
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto value = hn::LoadU(d, raw + i);
    const auto seen = hn::AndNot(hn::Lt(value, first), hn::Not(hn::Lt(last, value)));
    const auto other = fallback != nullptr ? hn::LoadU(d, fallback + i) : none;
    const auto kept = hn::IfThenElse(seen, value, other);
    all = all && hn::AllTrue(d, hn::Lt(kept, none));
    hn::StoreU(kept, d, out + i);
  }
  for (; i < count; ++i) {
    const bool seen = raw[i] >= raw_first && raw[i] <= raw_last;
    out[i] = seen ? raw[i] : fallback != nullptr ? fallback[i] : kRawNoMeasurement;
    all = all && out[i] < kRawNoMeasurement;
  }
  return all;
}

bool putHiddenRow(const std::uint16_t* hidden, int count, std::uint16_t* image) {
  const PixelTag d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto none = hn::Set(d, kRawNoMeasurement);
  bool any = false;
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto value = hn::LoadU(d, hidden + i);
    const auto known = hn::Lt(value, none);
    if (hn::AllFalse(d, known)) continue;
    const auto before = hn::LoadU(d, image + i);
    any = any || !hn::AllTrue(d, hn::Or(hn::Eq(value, before), hn::Not(known)));
    hn::StoreU(hn::IfThenElse(known, value, before), d, image + i);
  }
  for (; i < count; ++i) {
    if (hidden[i] >= kRawNoMeasurement) continue;
    any = any || image[i] != hidden[i];
    image[i] = hidden[i];
  }
  return any;
}

#if HWY_TARGET == HWY_SCALAR
/// Four rows of pixels from `image` on, which lies in a frame.
void sumUpRow(const std::uint16_t* image, int blocks, BlockRow& out) {
  constexpr int kSide = BlockLattice::kBlock_px;
  for (int block = 0; block < blocks; ++block) {
    out.sum[block] = out.count[block] = out.greatest[block] = 0;
    out.least[block] = kRawNoMeasurement;
    for (int pixel = 0; pixel < kSide * kSide; ++pixel) {
      const std::uint16_t value = image[pixel / kSide * kFrameWidth + block * kSide + pixel % kSide];
      if (value >= kRawNoMeasurement) continue;
      out.sum[block] += value;
      ++out.count[block];
      out.least[block] = std::min<std::uint64_t>(out.least[block], value);
      out.greatest[block] = std::max<std::uint64_t>(out.greatest[block], value);
    }
  }
}
#else
using BlockTag = hn::Repartition<std::uint64_t, PixelTag>;

/// The sum of the four pixels in each lane of 64 bits.
HWY_INLINE hn::Vec<BlockTag> sumOfLane(hn::Vec<PixelTag> pixels) {
  const BlockTag d64;
  const hn::Repartition<std::uint32_t, PixelTag> d32;
  const auto pairs = hn::BitCast(d32, pixels);
  const auto halves = hn::Add(hn::And(pairs, hn::Set(d32, 0xFFFFU)), hn::ShiftRight<16>(pairs));
  const auto wide = hn::BitCast(d64, halves);
  return hn::And(hn::Add(wide, hn::ShiftRight<32>(wide)), hn::Set(d64, 0xFFFFFFFFU));
}

/// Four rows of pixels from `image` on, which lies in a frame.
void sumUpRow(const std::uint16_t* image, int blocks, BlockRow& out) {
  static_assert(BlockLattice::kBlock_px == 4, "a block's row of pixels is one 64-bit lane");
  const PixelTag d;
  const BlockTag d64;
  const hn::Repartition<std::uint32_t, PixelTag> d32;
  const auto lanes = static_cast<int>(hn::Lanes(d64));
  const auto none = hn::Set(d, kRawNoMeasurement);
  const auto one = hn::Set(d, std::uint16_t{1});
  for (int block = 0; block < blocks; block += lanes) {
    auto sum = hn::Zero(d);
    auto count = hn::Zero(d);
    auto least = none;
    auto greatest = hn::Zero(d);
    for (int row = 0; row < BlockLattice::kBlock_px; ++row) {
      const auto value = hn::LoadU(d, image + row * kFrameWidth + block * BlockLattice::kBlock_px);
      const auto seen = hn::Lt(value, none);
      const auto kept = hn::IfThenElseZero(seen, value);
      sum = hn::Add(sum, kept);
      count = hn::Add(count, hn::IfThenElseZero(seen, one));
      least = hn::Min(least, value);
      greatest = hn::Max(greatest, kept);
    }
    const auto least2 = hn::Min(least, hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(d32, least))));
    // the upper half of each pair is of no use now: it was compared with zero
    const auto least4 = hn::Min(least2, hn::BitCast(d, hn::ShiftRight<32>(hn::BitCast(d64, least2))));
    const auto greatest2 = hn::Max(greatest, hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(d32, greatest))));
    const auto greatest4 =
        hn::Max(greatest2, hn::BitCast(d, hn::ShiftRight<32>(hn::BitCast(d64, greatest2))));
    const auto low = hn::Set(d64, 0xFFFFU);
    hn::StoreU(sumOfLane(sum), d64, out.sum + block);
    hn::StoreU(sumOfLane(count), d64, out.count + block);
    hn::StoreU(hn::And(hn::BitCast(d64, least4), low), d64, out.least + block);
    hn::StoreU(hn::And(hn::BitCast(d64, greatest4), low), d64, out.greatest + block);
  }
}
#endif

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(copyRow);
HWY_EXPORT(putHiddenRow);
HWY_EXPORT(sumUpRow);

namespace {

constexpr std::size_t pixelOf(int row, int column) noexcept {
  return static_cast<std::size_t>(row) * kFrameWidth + static_cast<std::size_t>(column);
}

/// The pixels [begin, end) of a row have no measurement.
struct Gap {
  int begin;
  int end;
};

void closeGap(std::uint16_t* row, Gap gap, const GapLimits& limits) noexcept {
  const float before = row[gap.begin - 1];
  const float change = static_cast<float>(row[gap.end]) - before;
  const auto length = static_cast<float>(gap.end - gap.begin);
  if (std::abs(change) > limits.most_raw + limits.most_raw_per_px * length) return;
  for (int i = gap.begin; i < gap.end; ++i) {
    const float share = static_cast<float>(i - gap.begin + 1) / (length + 1);
    row[i] = static_cast<std::uint16_t>(before + share * change + 0.5F);
  }
}

/// One row of the whole image, of which [first, last] are looked at.
void closeGaps(std::uint16_t* row, int first, int last, const GapLimits& limits) noexcept {
  for (int column = first; column <= last; ++column) {
    if (row[column] < kRawNoMeasurement) continue;
    Gap gap{column, column};
    while (gap.end <= last && row[gap.end] >= kRawNoMeasurement) ++gap.end;
    column = gap.end;
    if (gap.end - gap.begin > limits.longest_px) continue;
    if (gap.begin == 0 || gap.end == kFrameWidth) {
      std::fill(row + gap.begin, row + gap.end, SurfaceLayer::kBeyondView);
    } else if (gap.begin > first && gap.end <= last) {
      closeGap(row, gap, limits);
    }
  }
}

/// A block that is not all of one surface: the mean of its nearest one.
void sumUpMixed(const std::uint16_t* pixels, std::uint16_t farthest_raw, float& disparity) noexcept {
  constexpr int kFewest = 3;
  constexpr int kSide = BlockLattice::kBlock_px;
  int sum = 0;
  int count = 0;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      const std::uint16_t raw = pixels[pixelOf(row, column)];
      if (raw > farthest_raw) continue;
      sum += raw;
      ++count;
    }
  }
  disparity = count >= kFewest ? static_cast<float>(sum) / static_cast<float>(count) : -1;
}

}  // namespace

void copyClosingGaps(const std::uint16_t* raw, const std::uint16_t* fallback, const PixelWindow& window,
                     const GapLimits& limits, std::uint16_t* image) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelOf(row, window.column_first);
    const bool all =
        HWY_DYNAMIC_DISPATCH(copyRow)(raw + first, fallback != nullptr ? fallback + first : nullptr, columns,
                                      limits.raw_first, limits.raw_last, image + first);
    if (!all) closeGaps(image + pixelOf(row, 0), window.column_first, window.column_last, limits);
  }
}

bool putHidden(const std::uint16_t* hidden, const PixelWindow& window, std::uint16_t* image) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  bool any = false;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelOf(row, window.column_first);
    any = HWY_DYNAMIC_DISPATCH(putHiddenRow)(hidden + first, columns, image + first) || any;
  }
  return any;
}

void sumUpBlocks(const std::uint16_t* image, const BlockWindow& blocks, float jump_raw,
                 const BlockSums& sums) noexcept {
  constexpr int kSide = BlockLattice::kBlock_px;
  BlockRow line;
  for (int row = blocks.row_first; row <= blocks.row_last; ++row) {
    const std::uint16_t* const pixels = image + pixelOf(row * kSide, blocks.column_first * kSide);
    HWY_DYNAMIC_DISPATCH(sumUpRow)(pixels, blocks.columns(), line);
    const std::size_t first = BlockLattice::at(row, blocks.column_first);
    for (int i = 0; i < blocks.columns(); ++i) {
      const auto least = static_cast<float>(line.least[i]);
      const auto greatest = static_cast<float>(line.greatest[i]);
      float& disparity = sums.disparity[first + static_cast<std::size_t>(i)];
      const bool full = line.count[i] == kSide * kSide && greatest - least <= jump_raw;
      sums.is_full[first + static_cast<std::size_t>(i)] = full ? 1 : 0;
      if (full) {
        disparity = static_cast<float>(line.sum[i]) / (kSide * kSide);
      } else if (line.count[i] == 0) {
        disparity = -1;
      } else {
        sumUpMixed(pixels + i * kSide, static_cast<std::uint16_t>(std::min(least + jump_raw, 2046.0F)),
                   disparity);
      }
    }
  }
}

}  // namespace hapticd::rt
#endif
