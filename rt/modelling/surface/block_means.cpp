// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/surface/block_means.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/surface/block_means.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>

#include "hwy/cache_control.h"
#include "hwy/highway.h"
#include "rt/base/cache_line.h"
#include "rt/depth/depth_frame.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// As many lanes as a vector of doubles has, in which innovations are summed up.
using SumTag = hn::ScalableTag<double>;
using BlockTag = hn::Rebind<float, SumTag>;
using FrameTag = hn::Rebind<std::uint32_t, SumTag>;
using Blocks = hn::Vec<BlockTag>;
using BlockMask = hn::Mask<BlockTag>;

constexpr int kRowsAhead = 4;

HWY_INLINE Blocks set(float value) {
  return hn::Set(BlockTag(), value);
}

HWY_INLINE BlockMask isWithin(Blocks x, float first, float last) {
  return hn::And(hn::Ge(x, set(first)), hn::Le(x, set(last)));
}

/// Returns the lanes whose frame is `frame`.
HWY_INLINE BlockMask areOf(hn::Vec<FrameTag> frames, std::uint32_t frame) {
  return hn::RebindMask(BlockTag(), hn::Eq(frames, hn::Set(FrameTag(), frame)));
}

/// Prefetches a row of means: memory latency exceeds the time for a row.
HWY_INLINE void prefetchRow(const BlockMeans& means, std::size_t first, int blocks) {
  constexpr int kPerLine = static_cast<int>(kCacheLine / sizeof(float));
  for (int i = 0; i < blocks; i += kPerLine) {
    const std::size_t index = first + static_cast<std::size_t>(i);
    hwy::Prefetch(means.disparity.get() + index);
    hwy::Prefetch(means.frames.get() + index);
    hwy::Prefetch(means.updated.get() + index);
  }
}

/// Sums over the blocks of a row, in the lanes of vectors.
struct RowSums {
  using Sums = hn::Vec<SumTag>;
  Sums raw, raw_column, count, column, column_column;

  HWY_INLINE RowSums() { raw = raw_column = count = column = column_column = hn::Zero(SumTag()); }

  /// Adds the innovations of the blocks that count; `at`: their columns.
  HWY_INLINE void add(Blocks innovation, BlockMask counts, Blocks at) {
    const SumTag ds;
    const auto difference = hn::PromoteTo(ds, hn::IfThenElseZero(counts, innovation));
    const auto columns = hn::PromoteTo(ds, hn::IfThenElseZero(counts, at));
    raw = hn::Add(raw, difference);
    raw_column = hn::MulAdd(difference, columns, raw_column);
    count = hn::Add(count, hn::PromoteTo(ds, hn::IfThenElseZero(counts, set(1))));
    column = hn::Add(column, columns);
    column_column = hn::MulAdd(columns, columns, column_column);
  }

  HWY_INLINE void addTo(Innovations& all, double row) const {
    const auto total = [](Sums lanes) { return hn::GetLane(hn::SumOfLanes(SumTag(), lanes)); };
    const double of_row = total(raw);
    const double blocks = total(count);
    const double columns = total(column);
    all.raw += of_row;
    all.raw_column += total(raw_column);
    all.raw_row += row * of_row;
    all.count += blocks;
    all.column += columns;
    all.row += row * blocks;
    all.column_column += total(column_column);
    all.column_row += row * columns;
    all.row_row += row * row * blocks;
  }
};

void follow(const BlockLattice& lattice, const BlockWindow& blocks, const float* observed_raw,
            const float* offset_raw, const MeansUpdate& update, const BlockMeans& means,
            Innovations& innovations) {
  const BlockTag d;
  const FrameTag dn;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const BlockRegion& region = update.region;
  const auto continues = hn::FirstN(d, update.before != 0 ? hn::Lanes(d) : 0);
  for (int row = blocks.row_first; row <= blocks.row_last; ++row) {
    prefetchRow(means, lattice.at(std::min(row + kRowsAhead, blocks.row_last), blocks.column_first),
                blocks.columns() + 2 * lanes);
    const bool may_move = row >= region.blocks.row_first && row <= region.blocks.row_last;
    const auto last_column = static_cast<float>(may_move ? region.blocks.column_last : -1);
    const auto moved_in_row = set(update.moved_raw.atRow(row));
    RowSums sums;
    for (int column = blocks.column_first; column <= blocks.column_last; column += lanes) {
      const std::size_t index = lattice.at(row, column);
      const auto updated = hn::LoadU(dn, means.updated.get() + index);
      const auto inside = hn::FirstN(d, static_cast<std::size_t>(blocks.column_last - column + 1));
      const auto pending = hn::AndNot(areOf(updated, update.sequence), inside);
      const auto mean = hn::LoadU(d, means.disparity.get() + index);
      const auto observed = hn::LoadU(d, observed_raw + index);
      const auto now = hn::IfThenElse(hn::Lt(observed, set(0)), observed,
                                      hn::Sub(observed, hn::LoadU(d, offset_raw + column)));
      auto follows = hn::And(pending, hn::And(hn::Ge(mean, set(0)), hn::Ge(now, set(0))));
      follows = hn::And(follows, hn::And(continues, areOf(updated, update.before)));
      const auto at = hn::Iota(d, static_cast<float>(column));
      auto moves = isWithin(at, static_cast<float>(region.blocks.column_first), last_column);
      moves = hn::And(moves, isWithin(mean, region.disparity_least, region.disparity_greatest));
      const auto moved = hn::MulAdd(set(update.moved_raw.per_column), at, moved_in_row);
      const auto expected = hn::IfThenElse(moves, hn::Add(mean, moved), mean);
      const auto innovation = hn::Sub(now, expected);
      const auto size = hn::Abs(innovation);
      const auto counts = hn::And(hn::And(follows, moves), hn::Le(size, set(update.farthest_raw)));
      sums.add(innovation, counts, at);
      const auto longer =
          hn::Min(hn::Add(hn::LoadU(d, means.frames.get() + index), set(1)), set(update.max_frames));
      const auto same = hn::And(follows, hn::Le(size, set(update.most_raw)));
      const auto frames = hn::IfThenElse(same, longer, set(1));
      const auto next = hn::IfThenElse(follows, hn::Add(expected, hn::Div(innovation, frames)), now);
      hn::BlendedStore(next, pending, d, means.disparity.get() + index);
      hn::BlendedStore(frames, pending, d, means.frames.get() + index);
      hn::BlendedStore(hn::Set(dn, update.sequence), hn::RebindMask(dn, pending), dn,
                       means.updated.get() + index);
    }
    if (may_move) sums.addTo(innovations, row);
  }
}

void continueFrom(const BlockLattice& lattice, const BlockWindow& blocks, std::uint32_t before,
                  std::uint32_t sequence, const BlockMeans& from, const BlockMeans& to) {
  const BlockTag d;
  const FrameTag dn;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  for (int row = blocks.row_first; row <= blocks.row_last; ++row) {
    for (int column = blocks.column_first; column <= blocks.column_last; column += lanes) {
      const std::size_t index = lattice.at(row, column);
      const auto updated = hn::LoadU(dn, to.updated.get() + index);
      const auto is_current = hn::Or(areOf(updated, before), areOf(updated, sequence));
      const auto inside = hn::FirstN(d, static_cast<std::size_t>(blocks.column_last - column + 1));
      const auto known = hn::And(inside, areOf(hn::LoadU(dn, from.updated.get() + index), before));
      const auto takes = hn::AndNot(is_current, known);
      if (hn::AllFalse(d, takes)) continue;
      hn::BlendedStore(hn::LoadU(d, from.disparity.get() + index), takes, d, to.disparity.get() + index);
      hn::BlendedStore(hn::LoadU(d, from.frames.get() + index), takes, d, to.frames.get() + index);
      hn::BlendedStore(hn::Set(dn, before), hn::RebindMask(dn, takes), dn, to.updated.get() + index);
    }
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

BlockMeans::BlockMeans(const BlockLattice& lattice)
    : disparity(std::make_unique<float[]>(lattice.blocks() + kVectorPadding)),
      frames(std::make_unique<float[]>(lattice.blocks() + kVectorPadding)),
      updated(std::make_unique<std::uint32_t[]>(lattice.blocks() + kVectorPadding)) {}

BlockMotion BlockMotion::of(const DisparityMotion& motion, int first_row, int first_column) noexcept {
  constexpr double kBlock_px = BlockLattice::kBlock_px;
  return {.first = static_cast<float>(motion.at(first_column * kBlock_px + BlockLattice::kMiddle_px,
                                                first_row * kBlock_px + BlockLattice::kMiddle_px)),
          .per_column = static_cast<float>(kBlock_px * motion.per_column),
          .per_row = static_cast<float>(kBlock_px * motion.per_row)};
}

HWY_EXPORT(follow);
HWY_EXPORT(continueFrom);

void followBlocks(const BlockLattice& lattice, const BlockWindow& blocks, const float* observed_raw,
                  const float* offset_raw, const MeansUpdate& update, BlockMeans& means,
                  Innovations& innovations) noexcept {
  HWY_DYNAMIC_DISPATCH(follow)(lattice, blocks, observed_raw, offset_raw, update, means, innovations);
}

void continueBlocks(const BlockLattice& lattice, const BlockWindow& blocks, std::uint32_t before,
                    std::uint32_t sequence, const BlockMeans& from, BlockMeans& to) noexcept {
  HWY_DYNAMIC_DISPATCH(continueFrom)(lattice, blocks, before, sequence, from, to);
}

}  // namespace hapticd::rt
#endif
