// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/surface/block_image.cpp"
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
#include "rt/modelling/surface/block_image.h"

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
/// `visible` elsewhere; `image` may be `visible`. A pixel that is missing in `raw`, in a gap that was closed
/// with about the remembered value, flickers and hides nothing. Returns true if the two differ anywhere.
HWY_INLINE bool hideRow(const std::uint16_t* raw, const std::uint16_t* hidden, const std::uint16_t* visible,
                        const Columns& columns, const GapLimits& limits, std::uint16_t* image) {
  const PixelTag d;
  const auto same = all(limits.same_raw());
  auto differences = hn::Zero(d);
  forEachVector(columns, [&](int column, auto is_whole) {
    const auto value = hn::LoadU(d, hidden + column);
    const auto before = hn::LoadU(d, visible + column);
    const auto missing = isOutside(hn::LoadU(d, raw + column), limits.raw_first, limits.raw_last);
    const auto close = hn::Not(hn::Gt(hn::Sub(hn::Max(value, before), hn::Min(value, before)), same));
    const auto useless =
        hn::Or(isOutside(value, limits.remembered_first, limits.remembered_last), hn::And(missing, close));
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
HWY_INLINE bool fillHiddenRow(const std::uint16_t* raw, const std::uint16_t* remembered,
                              const std::uint16_t* visible, bool complete, int width, const Columns& columns,
                              const GapLimits& limits, std::uint16_t* hidden) {
  if (complete) return hideRow(raw, remembered, visible, columns, limits, hidden);
  // What was filled in bounds other gaps.
  PixelBits missing;
  copyRow(visible, columns, limits, hidden, missing);
  closeGaps(visible, missing, width, columns, limits, hidden);
  return hideRow(raw, remembered, hidden, columns, limits, hidden);
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
      hides |= fillHiddenRow(images.raw + at, images.remembered + at, images.visible + at,
                             complete[row - first], layout.width_px, columns, limits, images.hidden + at);
    }
  }
  return hides;
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(fillImages);

bool fillLayerImages(const LayerImages& images, const ImageLayout& layout, const PixelWindow& window,
                     const GapLimits& limits) noexcept {
  return HWY_DYNAMIC_DISPATCH(fillImages)(images, layout, window, limits);
}

}  // namespace hapticd::rt
#endif
