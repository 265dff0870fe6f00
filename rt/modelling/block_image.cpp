// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/block_image.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "hwy/cache_control.h"
#include "hwy/highway.h"
#include "rt/base/cache_line.h"
#include "rt/modelling/block_image.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Vectors of pixels begin at multiples of their length and are never longer than a word of PixelBits, so
/// that none passes the end of a row.
using PixelTag = hn::CappedTag<std::uint16_t, kRowAlignment_px>;
using Pixels = hn::Vec<PixelTag>;
using PixelMask = hn::Mask<PixelTag>;

/// One bit for each pixel of a row, by column.
struct PixelBits {
  static constexpr int kPerWord = 64;
  static_assert(kPerWord == kRowAlignment_px);
  std::uint64_t word[kMaxFrameWidth / kPerWord];
};

/// Columns of a row, both ends inclusive.
struct Columns {
  int first;
  int last;
};

/// Consecutive pixels [begin, end) of a row that have no measurement.
struct Gap {
  int begin;
  int end;
};

HWY_INLINE Pixels all(std::uint16_t value) {
  return hn::Set(PixelTag(), value);
}

/// Returns the lanes of the vector at `column` that lie within `columns`.
HWY_INLINE PixelMask lanesWithin(const Columns& columns, int column) {
  const auto at = hn::Iota(PixelTag(), static_cast<std::uint16_t>(column));
  const auto before = hn::Lt(at, all(static_cast<std::uint16_t>(columns.first)));
  const auto behind = hn::Lt(all(static_cast<std::uint16_t>(columns.last)), at);
  return hn::Not(hn::Or(before, behind));
}

/// Calls `visit(column, is_whole)` with the column of each vector of pixels that `columns` touch, and whether
/// all of its lanes lie within them.
template <typename Visit>
HWY_INLINE void forEachVector(const Columns& columns, Visit visit) {
  const auto lanes = static_cast<int>(hn::Lanes(PixelTag()));
  int column = columns.first / lanes * lanes;
  if (column < columns.first) {
    visit(column, std::false_type());
    column += lanes;
  }
  for (; column + lanes - 1 <= columns.last; column += lanes) visit(column, std::true_type());
  if (column <= columns.last) visit(column, std::false_type());
}

/// Stores the lanes of the vector at `column` that lie within `columns`. Whole vectors are not masked,
/// because masked stores delay loads of the same pixels.
template <typename IsWhole>
HWY_INLINE void storeWithin(const Columns& columns, int column, IsWhole, Pixels value, std::uint16_t* row) {
  if constexpr (IsWhole::value) {
    hn::StoreU(value, PixelTag(), row + column);
  } else {
    hn::BlendedStore(value, lanesWithin(columns, column), PixelTag(), row + column);
  }
}

/// Returns the lanes of `mask` that lie within `columns`.
template <typename IsWhole>
HWY_INLINE PixelMask maskWithin(const Columns& columns, int column, IsWhole, PixelMask mask) {
  if constexpr (IsWhole::value) {
    return mask;
  } else {
    return hn::And(mask, lanesWithin(columns, column));
  }
}

HWY_INLINE PixelMask isOutside(Pixels value, std::uint16_t first_raw, std::uint16_t last_raw) {
  return hn::Or(hn::Lt(value, all(first_raw)), hn::Lt(all(last_raw), value));
}

HWY_INLINE std::uint64_t bitsOf(PixelMask mask) {
  std::uint8_t bytes[sizeof(std::uint64_t)] = {};
  hn::StoreMaskBits(PixelTag(), mask, bytes);
  std::uint64_t bits;
  std::memcpy(&bits, bytes, sizeof bits);
  return bits;
}

/// Copies pixels from `raw` to `image`. A raw value outside `limits` has no depth and becomes
/// kNoRawDisparity. Returns whether there is one and sets the bits of all such pixels.
HWY_INLINE bool copyRow(const std::uint16_t* raw, const Columns& columns, const GapLimits& limits,
                        std::uint16_t* image, PixelBits& missing) {
  const PixelTag d;
  missing.word[columns.first / PixelBits::kPerWord] = 0;
  std::uint64_t any = 0;
  forEachVector(columns, [&](int column, auto is_whole) {
    const auto value = hn::LoadU(d, raw + column);
    const auto none =
        maskWithin(columns, column, is_whole, isOutside(value, limits.raw_first, limits.raw_last));
    storeWithin(columns, column, is_whole, hn::IfThenElse(none, all(kNoRawDisparity), value), image);
    const std::uint64_t bits = bitsOf(none);
    std::uint64_t& word = missing.word[column / PixelBits::kPerWord];
    const int bit = column % PixelBits::kPerWord;
    word = bit == 0 ? bits : word | bits << bit;
    any |= bits;
  });
  return any != 0;
}

/// Fills a gap of `image` by linear interpolation between its two neighbours in `raw`, if their difference is
/// within `limits`; returns whether it is.
HWY_INLINE bool closeGap(const std::uint16_t* raw, const Gap& gap, const GapLimits& limits,
                         std::uint16_t* image) {
  const hn::CappedTag<float, 8> df;  // most gaps are shorter
  const hn::RebindToSigned<decltype(df)> di;
  const hn::Rebind<std::uint16_t, decltype(df)> d;
  const float before = raw[gap.begin - 1];
  const float change = static_cast<float>(raw[gap.end]) - before;
  const int pixels = gap.end - gap.begin;
  const auto length = static_cast<float>(pixels);
  if (std::abs(change) > limits.max_raw + limits.max_raw_per_px * length) return false;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  for (int i = 0; i < pixels; i += lanes) {
    const auto share = hn::Div(hn::Iota(df, static_cast<float>(i + 1)), hn::Set(df, length + 1));
    const auto value =
        hn::Add(hn::Add(hn::Set(df, before), hn::Mul(share, hn::Set(df, change))), hn::Set(df, 0.5F));
    const auto pixel = hn::DemoteTo(d, hn::ConvertTo(di, value));
    hn::BlendedStore(pixel, hn::FirstN(d, static_cast<std::size_t>(pixels - i)), d, image + gap.begin + i);
  }
  return true;
}

/// Calls `visit(gap)` with each run of `missing` within `columns`; no other bit of their words is set.
template <typename Visit>
HWY_INLINE void forEachGap(const PixelBits& missing, const Columns& columns, Visit visit) {
  int begin = 0;
  bool open = false;
  std::uint64_t last_of_word_before = 0;
  for (int word = columns.first / PixelBits::kPerWord; word <= columns.last / PixelBits::kPerWord; ++word) {
    const std::uint64_t bits = missing.word[word];
    std::uint64_t edges = bits ^ (bits << 1 | last_of_word_before);
    last_of_word_before = bits >> (PixelBits::kPerWord - 1);
    for (; edges != 0; edges &= edges - 1) {
      const int column = word * PixelBits::kPerWord + std::countr_zero(edges);
      if (open) visit(Gap{begin, column});
      begin = column;
      open = !open;
    }
  }
  if (open) visit(Gap{begin, columns.last + 1});
}

/// Closes the gaps of one row of an image with `width` columns, which was copied from `raw`. Returns true if
/// all of them were closed.
HWY_INLINE bool closeGaps(const std::uint16_t* raw, const PixelBits& missing, int width,
                          const Columns& columns, const GapLimits& limits, std::uint16_t* image) {
  bool all_closed = true;
  forEachGap(missing, columns, [&](const Gap& gap) {
    bool closed = false;
    if (gap.end - gap.begin <= limits.longest_px) {
      if (gap.begin == 0 || gap.end == width) {
        std::fill(image + gap.begin, image + gap.end, SurfaceLayer::kBeyondView);
      } else if (gap.begin > columns.first && gap.end <= columns.last) {
        closed = closeGap(raw, gap, limits, image);
      }
    }
    all_closed = all_closed && closed;
  });
  return all_closed;
}

/// Replaces each pixel of `image` that has no measurement by that of `fallback` if its value lies within the
/// remembered ones. Returns true if every pixel has a value then.
HWY_INLINE bool fillRow(const std::uint16_t* fallback, const Columns& columns, const GapLimits& limits,
                        std::uint16_t* image) {
  const PixelTag d;
  bool complete = true;
  forEachVector(columns, [&](int column, auto is_whole) {
    const auto value = hn::LoadU(d, image + column);
    const auto other = hn::LoadU(d, fallback + column);
    const auto missing = maskWithin(columns, column, is_whole, hn::Not(hn::Lt(value, all(kNoRawDisparity))));
    const auto useless = isOutside(other, limits.remembered_first, limits.remembered_last);
    const auto filled = hn::IfThenElse(hn::AndNot(useless, missing), other, value);
    storeWithin(columns, column, is_whole, filled, image);
    complete = complete && hn::AllFalse(d, hn::And(useless, missing));
  });
  return complete;
}

/// Writes to `image` the pixels of `hidden` where these lie within the remembered ones, and those of
/// `visible` elsewhere; `image` may be `visible`. Returns true if the two differ anywhere.
HWY_INLINE bool hideRow(const std::uint16_t* hidden, const std::uint16_t* visible, const Columns& columns,
                        const GapLimits& limits, std::uint16_t* image) {
  const PixelTag d;
  auto differences = hn::Zero(d);
  forEachVector(columns, [&](int column, auto is_whole) {
    const auto value = hn::LoadU(d, hidden + column);
    const auto before = hn::LoadU(d, visible + column);
    const auto useless = isOutside(value, limits.remembered_first, limits.remembered_last);
    const auto useful = maskWithin(columns, column, is_whole, hn::Not(useless));
    differences = hn::Or(differences, hn::IfThenElseZero(useful, hn::Xor(value, before)));
    storeWithin(columns, column, is_whole, hn::IfThenElse(useful, value, before), image);
  });
  return !hn::AllTrue(d, hn::Eq(differences, hn::Zero(d)));
}

/// Fills a row of the visible surface's image. Returns true if every pixel has a value then.
HWY_INLINE bool fillVisibleRow(const std::uint16_t* raw, const std::uint16_t* remembered, int width,
                               const Columns& columns, const GapLimits& limits, std::uint16_t* visible) {
  PixelBits missing;
  if (!copyRow(raw, columns, limits, visible, missing)) return true;
  if (closeGaps(raw, missing, width, columns, limits, visible)) return true;
  return remembered != nullptr && fillRow(remembered, columns, limits, visible);
}

/// Fills a row of the hidden surface's image from that of the visible one, which is `complete` if each of its
/// pixels has a value. Returns true if they differ.
HWY_INLINE bool fillHiddenRow(const std::uint16_t* remembered, const std::uint16_t* visible, bool complete,
                              int width, const Columns& columns, const GapLimits& limits,
                              std::uint16_t* hidden) {
  if (complete) return hideRow(remembered, visible, columns, limits, hidden);
  // What was filled in bounds other gaps.
  PixelBits missing;
  copyRow(visible, columns, limits, hidden, missing);
  closeGaps(visible, missing, width, columns, limits, hidden);
  return hideRow(remembered, hidden, columns, limits, hidden);
}

/// Prefetches a row of both images, of which the machine does not know that they will be written.
HWY_INLINE void prefetchRow(const LayerImages& images, const ImageLayout& layout, int row,
                            const Columns& columns) {
  constexpr int kPerLine = static_cast<int>(kCacheLine / sizeof(std::uint16_t));
  for (int column = columns.first; column <= columns.last; column += kPerLine) {
    const std::size_t pixel = layout.at(row, column);
    hwy::Prefetch(images.visible + pixel);
    if (images.remembered != nullptr) hwy::Prefetch(images.hidden + pixel);
  }
}

bool fillImages(const LayerImages& images, const ImageLayout& layout, const PixelWindow& window,
                const GapLimits& given) {
  // Rows of the hidden surface follow some rows behind, because loads of pixels that were just stored wait.
  constexpr int kRowsTogether = 4;
  constexpr int kRowsAhead = 2 * kRowsTogether;
  const GapLimits limits = given;  // a local copy, so that the compiler knows that stores cannot change it
  const Columns columns{window.column_first, window.column_last};
  bool hides = false;
  for (int first = window.row_first; first <= window.row_last; first += kRowsTogether) {
    const int end = std::min(first + kRowsTogether, window.row_last + 1);
    bool complete[kRowsTogether];
    for (int row = first; row < end; ++row) {
      prefetchRow(images, layout, std::min(row + kRowsAhead, window.row_last), columns);
      const std::size_t at = layout.at(row, 0);
      const std::uint16_t* const remembered = images.remembered == nullptr ? nullptr : images.remembered + at;
      complete[row - first] =
          fillVisibleRow(images.raw + at, remembered, layout.width_px, columns, limits, images.visible + at);
    }
    if (images.remembered == nullptr) continue;
    for (int row = first; row < end; ++row) {
      const std::size_t at = layout.at(row, 0);
      hides |= fillHiddenRow(images.remembered + at, images.visible + at, complete[row - first],
                             layout.width_px, columns, limits, images.hidden + at);
    }
  }
  return hides;
}

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
  const auto none = all(kNoRawDisparity);
  if (HWY_LIKELY(hn::AllTrue(d, hn::Lt(hn::Max(hn::Max(v0, v1), hn::Max(v2, v3)), none)))) {
    result.sum = hn::Add(hn::Add(v0, v1), hn::Add(v2, v3));
    result.count = hn::Set(d64, BlockLattice::kBlock_px * BlockLattice::kBlock_px);
    return result;
  }
  const auto measured = [none](hn::Vec<PixelTag> value) {
    return hn::IfThenElseZero(hn::Lt(value, none), value);
  };
  const auto isMeasured = [none](hn::Vec<PixelTag> value) {
    return hn::IfThenElseZero(hn::Lt(value, none), all(1));
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

HWY_EXPORT(fillImages);
HWY_EXPORT(sumUpRow);

bool fillLayerImages(const LayerImages& images, const ImageLayout& layout, const PixelWindow& window,
                     const GapLimits& limits) noexcept {
  return HWY_DYNAMIC_DISPATCH(fillImages)(images, layout, window, limits);
}

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
