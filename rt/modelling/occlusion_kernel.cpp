// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/occlusion_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <bit>
#include <cstring>

#include "hwy/cache_control.h"
#include "hwy/highway.h"
#include "rt/depth/disparity_image.h"
#include "rt/modelling/occlusion_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using RawTag = hn::CappedTag<std::uint16_t, kOcclusionBlock>;
using Raws = hn::Vec<RawTag>;
using Pixels = hn::Mask<RawTag>;

constexpr std::uint16_t kRawBits = kRawDisparities - 1;

/// Number of rows to prefetch ahead: memory latency exceeds the time for one row of a window.
constexpr std::size_t kRowsAhead = 2;

/// One row of pixels, to which the pointers point, and its new measurements.
struct Row : OcclusionPixels {
  const std::uint16_t* raw;
  std::uint16_t now;
  std::size_t ahead;  ///< distance in pixels from this row to the one to prefetch

  HWY_INLINE bool isMeasured(std::size_t column) const { return raw[column] <= last_raw; }
};

HWY_INLINE Raws all(std::uint16_t value) {
  return hn::Set(RawTag(), value);
}

/// Returns the lanes in which `a` and `b`, which may wrap around, differ by more than `most`.
HWY_INLINE Pixels differ(Raws a, Raws b, Raws most) {
  return hn::Gt(hn::Add(hn::Sub(a, b), most), hn::Add(most, most));
}

HWY_INLINE Raws toleranceAt(const FallingTolerance& tolerance, Raws raw) {
  return hn::Sub(all(tolerance.at_zero), hn::MulHigh(raw, all(tolerance.fall)));
}

HWY_INLINE Pixels isAtLeast(Raws a, std::uint16_t least) {
  return hn::Gt(a, all(static_cast<std::uint16_t>(least - 1)));
}

HWY_INLINE Raws nearnessOf(const Row& row, Raws raw) {
  return row.falls ? hn::Sub(all(row.last_raw), raw) : raw;
}

/// Returns the lanes of `pixels` as bits.
HWY_INLINE std::uint32_t bitsOf(Pixels pixels) {
  std::uint8_t bytes[sizeof(std::uint32_t)] = {};
  hn::StoreMaskBits(RawTag(), pixels, bytes);
  std::uint32_t bits;
  std::memcpy(&bits, bytes, sizeof bits);
  return bits;
}

/// Returns the lanes of `pixels` in which one nearness lies in front of the shell of the other.
HWY_INLINE Pixels areApart(const Row& row, Pixels pixels, Raws nearness, Raws other) {
  const RawTag dr;
  const auto near = hn::Min(nearness, other);
  const auto far = hn::IfThenElseZero(pixels, hn::Max(nearness, other));
  // The end of a shell grows with distance, so a pixel not in front of the farthest shell's end is in front
  // of none.
  const auto farthest_end = row.shell_end[hn::GetLane(hn::MaxOfLanes(dr, far))];
  const auto apart = hn::And(pixels, hn::Lt(near, all(farthest_end)));
  if (hn::AllFalse(dr, apart)) return apart;
  HWY_ALIGN std::uint16_t ends[kOcclusionBlock];
  hn::Store(far, dr, ends);
  for (std::uint32_t bits = bitsOf(apart); bits != 0; bits &= bits - 1) {
    std::uint16_t& end = ends[std::countr_zero(bits)];
    end = row.shell_end[end];
  }
  return hn::And(apart, hn::Lt(near, hn::Load(dr, ends)));
}

/// Handles pixels that still show the same value, up to noise, and nothing that could be the hidden surface:
/// only their visible value changes. Stores it and returns whether this applies to all pixels of the vector.
template <bool kHides>
HWY_INLINE bool takeUnchanged(const Row& row, std::size_t column) {
  const RawTag dr;
  const auto raw = hn::LoadU(dr, row.raw + column);
  const auto before = hn::LoadU(dr, row.visible + column);
  const auto seen = hn::IfThenElse(hn::Gt(raw, all(row.last_raw)), all(kNothingSeen), raw);
  const auto min_shell = toleranceAt(row.min_shell, raw);
  auto changed = differ(seen, before, min_shell);
  if constexpr (kHides) {
    const auto hidden = hn::LoadU(dr, row.hidden + column);
    changed = hn::Or(changed, hn::Not(differ(seen, hidden, min_shell)));
  }
  hn::StoreU(hn::IfThenElse(changed, before, seen), dr, row.visible + column);
  return hn::AllFalse(dr, changed);
}

/// Updates one vector of pixels except those that are overdue, which it returns as bits. Adds to
/// `more_hidden`.
HWY_INLINE std::uint32_t takeChanged(const Row& row, std::size_t column, int& more_hidden) {
  const RawTag dr;
  const auto none = all(kNoRawDisparity);
  const auto now = all(row.now);
  const auto raw = hn::LoadU(dr, row.raw + column);
  const auto before = hn::LoadU(dr, row.visible + column);
  const auto hidden = hn::LoadU(dr, row.hidden + column);
  const auto since = hn::LoadU(dr, row.since + column);
  const auto age = hn::Sub(now, since);
  const auto before_raw = hn::And(before, all(kRawBits));
  const auto nearness = nearnessOf(row, raw);

  const auto missing = hn::Gt(raw, all(row.last_raw));
  const auto unknown = hn::Eq(before, all(kNothingSeen));
  const auto was_missing = hn::TestBit(before, all(kMissing));
  const auto hides_none = hn::Eq(hidden, none);
  auto withdrawn = hn::AndNot(missing, hn::TestBit(before, all(kOffered)));
  auto flickered = hn::AndNot(missing, was_missing);
  auto new_surface = hn::AndNot(missing, unknown);
  auto hidden_now = hidden;

  const auto jumps =
      hn::AndNot(hn::Or(missing, unknown), differ(raw, before_raw, toleranceAt(row.min_shell, raw)));
  if (!hn::AllFalse(dr, jumps)) {
    const auto nearness_before = nearnessOf(row, before_raw);
    const auto apart = areApart(row, jumps, nearness, nearness_before);
    const auto nearer = hn::And(apart, hn::Lt(nearness, nearness_before));
    const auto was_settled = hn::AndNot(was_missing, isAtLeast(age, row.settled_frames));
    const auto covers = hn::And(nearer, hn::Or(hides_none, was_settled));
    hidden_now = hn::IfThenElse(covers, before_raw, hidden_now);
    withdrawn = hn::AndNot(nearer, withdrawn);
    flickered = hn::AndNot(apart, flickered);
    new_surface = hn::Or(new_surface, apart);
  }
  hidden_now = hn::IfThenElse(withdrawn, none, hidden_now);
  const auto covered =
      hn::Lt(hn::Add(nearness, toleranceAt(row.rest_noise, raw)), nearnessOf(row, hidden_now));
  hidden_now = hn::IfThenElse(hn::Or(missing, covered), hidden_now, none);

  const auto lost = hn::AndNot(hn::Or(unknown, was_missing), missing);
  const auto offered = hn::And(lost, hides_none);
  hidden_now = hn::IfThenElse(offered, before, hidden_now);
  const auto flags = hn::IfThenElse(hides_none, all(kMissing | kOffered), all(kMissing));
  auto visible_now = hn::IfThenElse(missing, before, raw);
  visible_now = hn::IfThenElse(lost, hn::Or(before, flags), visible_now);
  auto since_now = hn::IfThenElse(hn::Or(new_surface, lost), now, since);
  since_now = hn::IfThenElse(flickered, hn::Sub(now, all(row.settled_frames)), since_now);

  hn::StoreU(visible_now, dr, row.visible + column);
  hn::StoreU(hidden_now, dr, row.hidden + column);
  hn::StoreU(since_now, dr, row.since + column);
  const int more = static_cast<int>(hn::CountTrue(dr, hides_none)) -
                   static_cast<int>(hn::CountTrue(dr, hn::Eq(hidden_now, none)));
  std::uint8_t& of_tile = row.hidden_of_tile[column / kOcclusionTile];
  of_tile = static_cast<std::uint8_t>(of_tile + more);
  more_hidden += more;
  const auto waits = hn::And(missing, was_missing);
  return bitsOf(hn::And(waits, isAtLeast(age, row.hold_frames)));
}

/// Consecutive pixels without measurement.
struct Gap {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::uint16_t nearest_beside = 0;  ///< nearest value beside the gap, as nearness
};

/// Returns the gap of a pixel without measurement.
HWY_INLINE Gap gapAround(const Row& row, std::size_t column) {
  Gap gap{column, column + 1, kNothingSeen};
  while (gap.begin > 0 && !row.isMeasured(gap.begin - 1)) --gap.begin;
  while (gap.end < row.stride_px && !row.isMeasured(gap.end)) ++gap.end;
  if (gap.begin > 0) gap.nearest_beside = row.nearnessOf(row.raw[gap.begin - 1]);
  if (gap.end < row.stride_px)
    gap.nearest_beside = std::min(gap.nearest_beside, row.nearnessOf(row.raw[gap.end]));
  return gap;
}

/// Forgets an overdue pixel, unless something nearer beside it casts the projector's shadow on it. `gap`:
/// that of the pixel before. Returns the change of the number of pixels that hide something.
HWY_INLINE int dropUnlessInShadow(const Row& row, std::size_t column, Gap& gap) {
  if (column >= gap.end) gap = gapAround(row, column);
  std::uint16_t& hidden = row.hidden[column];
  if (hidden != kNoRawDisparity && gap.nearest_beside < row.shell_end[row.nearnessOf(hidden)]) {
    row.since[column] = row.now;
    return 0;
  }
  row.visible[column] = kNothingSeen;
  if (hidden == kNoRawDisparity) return 0;
  hidden = kNoRawDisparity;
  --row.hidden_of_tile[column / kOcclusionTile];
  return -1;
}

/// Handles the unchanged pixels of a row and returns the blocks with others, one bit each.
template <bool kHides>
HWY_INLINE std::uint64_t takeUnchangedBlocks(const Row& row, const OcclusionWindow& window) {
  const std::size_t lanes = hn::Lanes(RawTag());
  // Without a branch per block, because which blocks change is unpredictable.
  std::uint64_t changed = 0;
  for (std::size_t block = window.block_first; block <= window.block_last; ++block) {
    bool unchanged = true;
    const std::size_t soon = block * kOcclusionBlock + row.ahead;
    hwy::Prefetch(row.raw + soon);
    hwy::Prefetch(row.visible + soon);
    if (kHides) {
      hwy::Prefetch(row.hidden + soon);
      hwy::Prefetch(row.since + soon);
    }
    for (std::size_t part = 0; part < kOcclusionBlock; part += lanes) {
      unchanged &= takeUnchanged<kHides>(row, block * kOcclusionBlock + part);
    }
    changed |= static_cast<std::uint64_t>(!unchanged) << block;
  }
  return changed;
}

/// Updates a row; returns the change of the number of pixels that hide something.
HWY_INLINE int seeRow(const Row& row, const OcclusionWindow& window) {
  const std::size_t lanes = hn::Lanes(RawTag());
  std::uint8_t hides = 0;
  const std::size_t tile_last = window.block_last * kOcclusionBlock / kOcclusionTile;
  for (std::size_t tile = window.block_first * kOcclusionBlock / kOcclusionTile; tile <= tile_last; ++tile) {
    hides |= row.hidden_of_tile[tile];
  }
  std::uint64_t changed =
      hides != 0 ? takeUnchangedBlocks<true>(row, window) : takeUnchangedBlocks<false>(row, window);
  int more_hidden = 0;
  Gap gap;
  for (; changed != 0; changed &= changed - 1) {
    const std::size_t first = static_cast<std::size_t>(std::countr_zero(changed)) * kOcclusionBlock;
    std::uint32_t overdue = 0;
    for (std::size_t part = 0; part < kOcclusionBlock; part += lanes) {
      overdue |= takeChanged(row, first + part, more_hidden) << part;
    }
    for (; overdue != 0; overdue &= overdue - 1) {
      more_hidden +=
          dropUnlessInShadow(row, first + static_cast<std::size_t>(std::countr_zero(overdue)), gap);
    }
  }
  return more_hidden;
}

int seeRows(const OcclusionPixels& pixels, const OcclusionWindow& given, const std::uint16_t* raw,
            std::uint16_t now) {
  const OcclusionWindow window = given;  // local copies, which stores cannot change
  Row row{pixels, raw, now, kRowsAhead * pixels.stride_px};
  const std::size_t skipped = window.row_first * row.stride_px;
  row.raw += skipped;
  row.visible += skipped;
  row.hidden += skipped;
  row.since += skipped;
  row.hidden_of_tile += skipped / kOcclusionTile;
  int more_hidden = 0;
  for (std::size_t i = window.row_first; i <= window.row_last; ++i) {
    if (i + kRowsAhead >= row.rows) row.ahead = 0;
    more_hidden += seeRow(row, window);
    row.raw += row.stride_px;
    row.visible += row.stride_px;
    row.hidden += row.stride_px;
    row.since += row.stride_px;
    row.hidden_of_tile += row.stride_px / kOcclusionTile;
  }
  return more_hidden;
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(seeRows);

int updatePixels(const OcclusionPixels& pixels, const OcclusionWindow& window, const std::uint16_t* raw,
                 std::uint16_t now) noexcept {
  return HWY_DYNAMIC_DISPATCH(seeRows)(pixels, window, raw, now);
}

}  // namespace hapticd::rt
#endif
