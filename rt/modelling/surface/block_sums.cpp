// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/surface/block_sums.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "hwy/highway.h"
#include "rt/modelling/surface/block_sums.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PixelTag = hn::ScalableTag<std::uint16_t>;

/// One bit for each pixel of a block, row by row.
using BlockBits = std::uint32_t;

/// Spreads `bits` to linked neighbours. A bit set in `links` means that its pixel and the one `step` bits
/// further on belong to the same surface.
HWY_INLINE BlockBits grown(BlockBits bits, BlockBits links, int step) {
  return bits | ((bits & links) << step) | ((bits >> step) & links);
}

/// Returns the mean raw value of the nearest surface in a block that shows more than one: the pixels
/// connected to the nearest pixel by differences of at most `max_step`. Returns -1 if these are too few.
HWY_INLINE float meanOfNearest(const std::uint16_t* image, int stride, int max_step) {
  constexpr int kMin = 3;
  constexpr int kSide = BlockLattice::kBlock_px;
  constexpr int kPixels = kSide * kSide;
  constexpr BlockBits kHaveRight = 0x7777;
  constexpr BlockBits kHaveBelow = 0x0FFF;
  const hn::CappedTag<std::uint16_t, kPixels> d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto none = hn::Set(d, kNoRawDisparity);
  const auto most = hn::Set(d, static_cast<std::uint16_t>(std::min<int>(max_step, kNoRawDisparity)));
  // Neighbours behind the last pixel are loaded as well.
  HWY_ALIGN std::uint16_t pixels[2 * kPixels];
  for (int row = 0; row < kSide; ++row) std::copy_n(image + row * stride, kSide, pixels + row * kSide);
  std::fill_n(pixels + kPixels, kPixels, kNoRawDisparity);
  const auto bitsOfLanes = [d](hn::Mask<decltype(d)> mask) {
    std::uint8_t bytes[sizeof(BlockBits)] = {};
    hn::StoreMaskBits(d, mask, bytes);
    BlockBits bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits;
  };
  BlockBits to_right = 0;
  BlockBits to_below = 0;
  auto least = hn::Set(d, std::uint16_t{0xFFFF});
  for (int i = 0; i < kPixels; i += lanes) {
    const auto value = hn::Load(d, pixels + i);
    const auto isLinkedTo = [&](hn::Vec<decltype(d)> other) {
      const auto step = hn::Sub(hn::Max(value, other), hn::Min(value, other));
      return hn::AndNot(hn::Gt(step, most), hn::Lt(hn::Max(value, other), none));
    };
    to_right |= bitsOfLanes(isLinkedTo(hn::LoadU(d, pixels + i + 1))) << i;
    to_below |= bitsOfLanes(isLinkedTo(hn::LoadU(d, pixels + i + kSide))) << i;
    least = hn::Min(least, value);
  }
  to_right &= kHaveRight;
  to_below &= kHaveBelow;
  BlockBits nearest = 0;
  for (int i = 0; i < kPixels; i += lanes) {
    nearest |= bitsOfLanes(hn::Eq(hn::Load(d, pixels + i), hn::MinOfLanes(d, least))) << i;
  }
  BlockBits surface = nearest & ~(nearest - 1);  // the first one
  for (BlockBits before = 0; before != surface;) {
    before = surface;
    surface = grown(grown(surface, to_right, 1), to_below, kSide);
  }
  int sum = 0;
  for (int i = 0; i < kPixels; ++i) sum += static_cast<int>(surface >> i & 1U) * pixels[i];
  const int count = std::popcount(surface);
  return count >= kMin ? static_cast<float>(sum) / static_cast<float>(count) : -1;
}

#if HWY_TARGET == HWY_SCALAR
/// Computes the statistics of `blocks` adjacent blocks. `image` points to the upper left pixel of the first
/// block, inside an image whose rows are `stride` pixels apart.
void sumUpRow(const std::uint16_t* image, int stride, int blocks, int max_step, const BlockSums& out) {
  constexpr int kSide = BlockLattice::kBlock_px;
  for (int block = 0; block < blocks; ++block) {
    int sum = 0;
    int count = 0;
    int largest_step = 0;
    for (int row = 0; row < kSide; ++row) {
      const std::uint16_t* const pixels = image + row * stride + block * kSide;
      for (int column = 0; column < kSide; ++column) {
        const int value = pixels[column];
        if (value < kNoRawDisparity) {
          sum += value;
          ++count;
        }
        if (column > 0) largest_step = std::max(largest_step, std::abs(value - pixels[column - 1]));
        if (row > 0) largest_step = std::max(largest_step, std::abs(value - pixels[column - stride]));
      }
    }
    const bool full = count == kSide * kSide && largest_step <= max_step;
    out.is_full[block] = full ? 1 : 0;
    if (full) {
      out.disparity[block] = static_cast<float>(sum) / (kSide * kSide);
    } else {
      out.disparity[block] = count == 0 ? -1 : meanOfNearest(image + block * kSide, stride, max_step);
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

/// Returns the size of the difference; raw disparities have fewer bits than signed numbers of their size.
HWY_INLINE hn::Vec<PixelTag> stepBetween(hn::Vec<PixelTag> a, hn::Vec<PixelTag> b) {
  const hn::RebindToSigned<PixelTag> d;
  return hn::BitCast(PixelTag(), hn::Abs(hn::BitCast(d, hn::Sub(a, b))));
}

/// The four rows of pixels of a vector of blocks.
struct BlockPixels {
  hn::Vec<PixelTag> sum;           ///< of the measured ones in a column of pixels
  hn::Vec<BlockTag> count;         ///< of the measured ones in a block
  hn::Vec<BlockTag> largest_step;  ///< between adjacent pixels of a block
};

HWY_INLINE BlockPixels pixelsOf(const std::uint16_t* image, int stride) {
  const PixelTag d;
  const BlockTag d64;
  const auto v0 = hn::LoadU(d, image);
  const auto v1 = hn::LoadU(d, image + stride);
  const auto v2 = hn::LoadU(d, image + 2 * stride);
  const auto v3 = hn::LoadU(d, image + 3 * stride);
  const auto stepAcross = [d, d64](hn::Vec<PixelTag> value) {
    return stepBetween(value, hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(d64, value))));
  };
  const auto has_right_neighbour = hn::BitCast(d, hn::Set(d64, 0xFFFFFFFFFFFFU));
  const auto across =
      hn::Max(hn::Max(stepAcross(v0), stepAcross(v1)), hn::Max(stepAcross(v2), stepAcross(v3)));
  const auto down = hn::Max(stepBetween(v0, v1), hn::Max(stepBetween(v1, v2), stepBetween(v2, v3)));
  BlockPixels result;
  result.largest_step = maxPerLane(hn::Max(down, hn::And(across, has_right_neighbour)));
  const auto none = hn::Set(d, kNoRawDisparity);
  if (HWY_LIKELY(hn::AllTrue(d, hn::Lt(hn::Max(hn::Max(v0, v1), hn::Max(v2, v3)), none)))) {
    result.sum = hn::Add(hn::Add(v0, v1), hn::Add(v2, v3));
    result.count = hn::Set(d64, BlockLattice::kBlock_px * BlockLattice::kBlock_px);
    return result;
  }
  const auto measured = [none](hn::Vec<PixelTag> value) {
    return hn::IfThenElseZero(hn::Lt(value, none), value);
  };
  const auto isMeasured = [none](hn::Vec<PixelTag> value) {
    return hn::IfThenElseZero(hn::Lt(value, none), hn::Set(PixelTag(), std::uint16_t{1}));
  };
  result.sum = hn::Add(hn::Add(measured(v0), measured(v1)), hn::Add(measured(v2), measured(v3)));
  result.count =
      sumPerLane(hn::Add(hn::Add(isMeasured(v0), isMeasured(v1)), hn::Add(isMeasured(v2), isMeasured(v3))));
  return result;
}

/// Computes the statistics of `blocks` adjacent blocks. `image` points to the upper left pixel of the first
/// block, inside an image whose rows are `stride` pixels apart. Whole vectors are read and written.
void sumUpRow(const std::uint16_t* image, int stride, int blocks, int max_step, const BlockSums& out) {
  constexpr int kSide = BlockLattice::kBlock_px;
  static_assert(kSide == 4, "a block's row of pixels is one 64-bit lane");
  const BlockTag d64;
  const hn::Rebind<std::uint32_t, BlockTag> d32;
  const hn::Rebind<float, BlockTag> df;
  const hn::Rebind<std::uint8_t, BlockTag> d8;
  const auto lanes = static_cast<int>(hn::Lanes(d64));
  for (int block = 0; block < blocks; block += lanes) {
    const BlockPixels pixels = pixelsOf(image + block * kSide, stride);
    const auto measured = hn::TruncateTo(d32, pixels.count);
    const auto step = hn::TruncateTo(d32, pixels.largest_step);
    const auto total =
        hn::BitCast(hn::RebindToSigned<decltype(d32)>(), hn::TruncateTo(d32, sumPerLane(pixels.sum)));
    const auto full = hn::And(hn::Eq(measured, hn::Set(d32, kSide * kSide)),
                              hn::Not(hn::Gt(step, hn::Set(d32, static_cast<std::uint32_t>(max_step)))));
    const auto mean = hn::Mul(hn::ConvertTo(df, total), hn::Set(df, 1.0F / (kSide * kSide)));
    hn::StoreU(hn::IfThenElse(hn::RebindMask(df, full), mean, hn::Set(df, -1.0F)), df, out.disparity + block);
    hn::StoreU(hn::TruncateTo(d8, hn::IfThenElseZero(full, hn::Set(d32, 1U))), d8, out.is_full + block);
    const auto inside = hn::FirstN(d32, static_cast<std::size_t>(blocks - block));
    const auto others = hn::And(inside, hn::Not(hn::Or(full, hn::Eq(measured, hn::Zero(d32)))));
    if (hn::AllFalse(d32, others)) continue;
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d32, others, bits);
    for (int i = 0; i < lanes; ++i) {
      if ((bits[i / 8] >> (i % 8) & 1) == 0) continue;
      out.disparity[block + i] = meanOfNearest(image + (block + i) * kSide, stride, max_step);
    }
  }
}
#endif

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(sumUpRow);

void sumUpBlocks(const std::uint16_t* image, const ImageLayout& layout, const BlockLattice& lattice,
                 const BlockWindow& blocks, int max_step, const BlockSums& sums) noexcept {
  constexpr int kSide = BlockLattice::kBlock_px;
  for (int row = blocks.row_first; row <= blocks.row_last; ++row) {
    const std::uint16_t* const pixels = image + layout.at(row * kSide, blocks.column_first * kSide);
    const std::size_t first = lattice.at(row, blocks.column_first);
    HWY_DYNAMIC_DISPATCH(sumUpRow)
    (pixels, layout.stride_px, blocks.columns(), max_step, {sums.disparity + first, sums.is_full + first});
  }
}

}  // namespace hapticd::rt
#endif
