// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, after the kernel's includes and before its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_CELLS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_CELLS_INL_H_
#undef HAPTICD_RT_FACET_CELLS_INL_H_
#else
#define HAPTICD_RT_FACET_CELLS_INL_H_
#endif

#include <algorithm>

#include "rt/modelling/surface/facet_mean-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// The finished facets of a row of sites, which the cells above and below it are found from. Whole vectors
/// are read and written.
struct FacetRow {
  static constexpr std::size_t kSize = BlockLattice::kMaxColumns + 2 * FacetBlocks::kPadding;
  HWY_ALIGN float disparity[kSize];
  HWY_ALIGN float per_column[kSize];
  HWY_ALIGN float per_row[kSize];
};

/// Averages the estimates of a row of sites and stores the facets.
HWY_INLINE void finishRow(const FacetBlocks& blocks, const FacetMemory& memory, const FacetMotion& motion,
                          int row, FacetRow& out, Facet* facets) {
  const FloatTag df;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  // The mean of a block differs from the value at its middle by the curvature within the block.
  constexpr float kSide = BlockLattice::kBlock_px;
  constexpr float kCurvatureOfMean = (kSide * kSide - 1) / (12 * kSide * kSide);
  constexpr float kPer_px = 1.0F / BlockLattice::kBlock_px;
  const BlockRegion& region = motion.region;
  const bool may_move = row >= region.blocks.row_first && row <= region.blocks.row_last;
  const auto last_column = static_cast<float>(may_move ? region.blocks.column_last : -1);
  for (int site = 0; site < blocks.sites_across; site += lanes) {
    const std::size_t index = FacetBlocks::at(row, site);
    const Facets mean = meanOfEstimates(memory.estimates, index);
    const auto known = hn::Ge(load(blocks.disparity + index), set(0));
    const auto at_middle = hn::NegMulAdd(set(kCurvatureOfMean), mean.curvature, mean.value);
    const auto disparity = hn::IfThenElse(known, at_middle, set(-1));
    const auto per_column = hn::Mul(mean.slope_u, set(kPer_px));
    const auto per_row = hn::Mul(mean.slope_v, set(kPer_px));
    const auto at = hn::Iota(df, static_cast<float>(site));
    const auto here = hn::And(hn::Ge(at, set(static_cast<float>(region.blocks.column_first))),
                              hn::Le(at, set(last_column)));
    const auto near = hn::And(hn::Ge(disparity, set(region.disparity_least)),
                              hn::Le(disparity, set(region.disparity_greatest)));
    const auto rate = hn::MulAdd(set(motion.per_second.per_column), at, set(motion.per_second.atRow(row)));
    const auto per_second = hn::IfThenElseZero(hn::And(here, near), rate);
    store(disparity, out.disparity + site);
    store(per_column, out.per_column + site);
    store(per_row, out.per_row + site);
    HWY_ALIGN Facet facet[hn::MaxLanes(df)];
    hn::StoreInterleaved4(disparity, per_column, per_row, per_second, df, &facet[0].disparity);
    std::copy_n(facet, std::min(blocks.sites_across - site, lanes), facets + site);
  }
}

/// Facets at one corner of a vector of cells.
struct Corner {
  Floats disparity, per_column, per_row;

  HWY_INLINE Corner(const FacetRow& row, int column)
      : disparity(load(row.disparity + column)),
        per_column(load(row.per_column + column)),
        per_row(load(row.per_row + column)) {}
};

/// Differences between the facets of a vector of cells.
class CellSides {
 public:
  // defined here so that it is compiled for the same instruction set as the functions it calls
  HWY_INLINE CellSides() { least_ = greatest_ = step_ = set(0); }

  /// Adds two facets that are a block apart, in the direction in which their slopes are `slope_a` and
  /// `slope_b`.
  HWY_INLINE void add(const Corner& a, const Corner& b, Floats slope_a, Floats slope_b) {
    constexpr float kHalf = 0.5F * BlockLattice::kBlock_px;
    // Mean deviation from the values predicted by each other's plane, and deviation from a surface with
    // constant curvature between them.
    const auto bend = hn::Mul(set(kHalf), hn::Sub(slope_b, slope_a));
    const auto expected = hn::Mul(set(kHalf), hn::Add(slope_a, slope_b));
    least_ = hn::Min(least_, bend);
    greatest_ = hn::Max(greatest_, bend);
    step_ = hn::Max(step_, hn::Abs(hn::Sub(hn::Sub(b.disparity, a.disparity), expected)));
  }

  /// Returns the kinds of the cells as numbers, mixed where they are not `known`.
  HWY_INLINE Floats kinds(const CellLimits& limits, Lanes known) const {
    const auto max_bend = set(limits.max_bend);
    const auto below = hn::Neg(least_);
    const auto numberOf = [](Cell kind) { return set(static_cast<float>(kind)); };
    const auto is_least = hn::And(hn::Gt(below, max_bend), hn::Lt(greatest_, max_bend));
    const auto is_greatest = hn::And(hn::Gt(greatest_, max_bend), hn::Lt(below, max_bend));
    const auto is_smooth = hn::Le(step_, set(limits.max_step));
    static_assert(static_cast<int>(Cell::mixed) == 0);
    auto kind = hn::IfThenElseZero(is_smooth, numberOf(Cell::smooth));
    kind = hn::IfThenElse(is_greatest, numberOf(Cell::greatest), kind);
    kind = hn::IfThenElse(is_least, numberOf(Cell::least), kind);
    return hn::IfThenElseZero(known, kind);
  }

 private:
  Floats least_, greatest_, step_;
};

/// Finds the kinds of `count` cells between two rows of facets.
HWY_INLINE void classifyCells(const FacetRow& above, const FacetRow& below, int count,
                              const CellLimits& limits, const std::uint8_t* full_above,
                              const std::uint8_t* full_below, Cell* cells) {
  const FloatTag df;
  const hn::RebindToSigned<FloatTag> di;
  const hn::Rebind<std::uint8_t, FloatTag> d8;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  for (int column = 0; column < count; column += lanes) {
    const auto full =
        hn::And(hn::And(hn::LoadU(d8, full_above + column), hn::LoadU(d8, full_above + column + 1)),
                hn::And(hn::LoadU(d8, full_below + column), hn::LoadU(d8, full_below + column + 1)));
    const auto all_full = hn::RebindMask(df, hn::Gt(hn::PromoteTo(di, full), hn::Zero(di)));
    const Corner a(above, column);
    const Corner b(above, column + 1);
    const Corner c(below, column);
    const Corner d(below, column + 1);
    const auto nearest = hn::Min(hn::Min(a.disparity, b.disparity), hn::Min(c.disparity, d.disparity));
    CellSides sides;
    sides.add(a, b, a.per_column, b.per_column);
    sides.add(c, d, c.per_column, d.per_column);
    sides.add(a, c, a.per_row, c.per_row);
    sides.add(b, d, b.per_row, d.per_row);
    const auto known = hn::And(all_full, hn::Ge(nearest, set(0)));
    HWY_ALIGN std::uint8_t kinds[hn::MaxLanes(df)];
    hn::Store(hn::DemoteTo(d8, hn::ConvertTo(di, sides.kinds(limits, known))), d8, kinds);
    std::transform(kinds, kinds + std::min(count - column, lanes), cells + column,
                   [](std::uint8_t kind) { return static_cast<Cell>(kind); });
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
