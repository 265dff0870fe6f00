// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/surface/facet_fit.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/surface/facet_fit.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>

#include "hwy/highway.h"
#include "rt/modelling/surface/facet_cells-inl.h"
#include "rt/modelling/surface/facet_growth-inl.h"
#include "rt/modelling/surface/facet_mean-inl.h"
#include "rt/modelling/surface/facet_start-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// Flags of the rows of sites and of those around them.
class RowFlags {
 public:
  HWY_INLINE bool operator[](int row) const { return flags_[row + kRing]; }
  HWY_INLINE void set(int row) { flags_[row + kRing] = true; }

 private:
  bool flags_[BlockLattice::kMaxRows + 2 * kRing] = {};
};

/// Fits the quadratics around all sites, and the planes around those whose own quadratic does not fit. Where
/// the plane does not fit either, fits both around everything nearby too.
void fitSmallSupports(const FacetBlocks& blocks, const FacetFit& fit, const FacetMemory& memory) {
  const FloatTag df;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  RowFlags near_search;
  bool any = false;
  for (int row = 0; row < blocks.sites_down; ++row) {
    for (int site = 0; site < blocks.sites_across; site += lanes) {
      const std::size_t index = FacetBlocks::at(row, site);
      const Lanes good = fitSmallQuadratic(blocks, fit, index, memory.quadratics);
      const Lanes others = hn::AndNot(good, knownSites(blocks, row, site));
      if (hn::AllFalse(df, others)) continue;
      fitSmallPlane(blocks, fit, index, memory.planes);
      if (hn::AllFalse(df, hn::And(others, needsNeighbours(fit, index, memory.planes)))) continue;
      any = true;
      for (int near = row - kRing; near <= row + kRing; ++near) near_search.set(near);
    }
  }
  if (!any) return;
  for (int row = -kRing; row < blocks.sites_down + kRing; ++row) {
    if (!near_search[row]) continue;
    for (int site = -kRing; site < blocks.sites_across + kRing; site += lanes) {
      const std::size_t index = FacetBlocks::at(row, site);
      fitSmallQuadratic(blocks, fit, index, memory.quadratics);
      fitSmallPlane(blocks, fit, index, memory.planes);
    }
  }
}

/// Computes means over boxes of kSide x kSide blocks for the supports of sites, up to `reach` blocks beyond
/// them. Where a block of the box has no measurement, the value of the middle block is used.
template <int kSide>
void meansOfBoxes(const FacetBlocks& blocks, int reach, float* row_sums, float* means) {
  constexpr int kHalf = kSide / 2;
  constexpr float kNoSum = -1e9F;
  const auto lanes = static_cast<int>(hn::Lanes(FloatTag()));
  for (int row = -reach - kHalf; row < blocks.sites_down + reach + kHalf; ++row) {
    for (int column = -reach; column < blocks.sites_across + reach; column += lanes) {
      const std::size_t index = FacetBlocks::at(row, column);
      auto sum = set(0);
      auto least = set(0);
      for (int i = -kHalf; i <= kHalf; ++i) {
        const auto there = load(blocks.disparity + moved(index, 0, i));
        sum = hn::Add(sum, there);
        least = hn::Min(least, there);
      }
      store(hn::IfThenElse(hn::Ge(least, set(0)), sum, set(kNoSum)), row_sums + index);
    }
  }
  for (int row = -reach; row < blocks.sites_down + reach; ++row) {
    for (int column = -reach; column < blocks.sites_across + reach; column += lanes) {
      const std::size_t index = FacetBlocks::at(row, column);
      auto sum = set(0);
      for (int i = -kHalf; i <= kHalf; ++i) sum = hn::Add(sum, load(row_sums + moved(index, i, 0)));
      const auto mean = hn::Mul(sum, set(1.0F / (kSide * kSide)));
      store(hn::IfThenElse(hn::Ge(sum, set(0)), mean, load(blocks.disparity + index)), means + index);
    }
  }
}

/// Grows the support of each site; holds everything that does not depend on the site.
class Growth {
 public:
  HWY_INLINE Growth(const FacetBlocks& blocks, const FacetFit& fit, const FacetMemory& memory)
      : blocks_(blocks),
        fit_(fit),
        memory_(memory),
        to_three_(firstTolerance<kThree>(fit)),
        to_five_(firstTolerance<kFive>(fit)),
        to_nine_(toleranceAfter<kNine>(kFive, fit)),
        to_fifteen_(toleranceAfter<kFifteen>(kNine, fit)),
        to_twenty_five_(toleranceAfter<kTwentyFive>(kFifteen, fit)) {}

  /// Returns the estimates of a vector of sites; only those in `requested` are meaningful.
  HWY_INLINE Estimate estimateFor(std::size_t index, Lanes requested) const {
    const FloatTag df;
    const float* const disparity = blocks_.disparity;
    Lanes ready;
    Lanes taken;
    Estimate estimate = startOf(blocks_, fit_, index, memory_, requested, ready, taken);
    auto chain = hn::IfThenElseZero(requested, set(1));
    if (!hn::AllTrue(df, ready)) {
      growCurved<kThree>(disparity, index, fit_, to_three_, taken, estimate, chain);
      growCurved<kFive>(disparity, index, fit_, to_five_, ready, estimate, chain);
    }
    if (!mayGrow<kNine>(chain)) return estimate;
    const Lanes none = hn::FirstN(df, 0);
    if (mayBeCurved<kNine>()) {
      growCurved<kNine>(disparity, index, fit_, to_nine_, none, estimate, chain);
    } else {
      growFlat<kNine>(disparity, index, fit_, to_nine_, estimate, chain);
    }
    if (!mayGrow<kFifteen>(chain)) return estimate;
    if (mayBeCurved<kFifteen>()) {
      growCurved<kFifteen>(memory_.mean_of_9, index, fit_, to_fifteen_, none, estimate, chain);
    } else {
      growFlat<kFifteen>(memory_.mean_of_9, index, fit_, to_fifteen_, estimate, chain);
    }
    if (!mayGrow<kTwentyFive>(chain)) return estimate;
    growFlat<kTwentyFive>(memory_.mean_of_25, index, fit_, to_twenty_five_, estimate, chain);
    return estimate;
  }

 private:
  template <const Support& kSupport>
  HWY_INLINE bool mayGrow(Floats chain) const {
    return kSupport.side() <= fit_.largest_plane && !hn::AllTrue(FloatTag(), hn::Le(chain, set(0)));
  }
  template <const Support& kSupport>
  HWY_INLINE bool mayBeCurved() const {
    return kSupport.side() <= fit_.largest_quadratic;
  }

  const FacetBlocks& blocks_;
  const FacetFit& fit_;
  const FacetMemory& memory_;
  Tolerance<kThree> to_three_;
  Tolerance<kFive> to_five_;
  Tolerance<kNine> to_nine_;
  Tolerance<kFifteen> to_fifteen_;
  Tolerance<kTwentyFive> to_twenty_five_;
};

void estimateSites(const FacetBlocks& blocks, const FacetFit& fit, const FacetMemory& memory) {
  const auto lanes = static_cast<int>(hn::Lanes(FloatTag()));
  const Growth growth(blocks, fit, memory);
  for (int row = 0; row < blocks.sites_down; ++row) {
    for (int site = 0; site < blocks.sites_across; site += lanes) {
      const std::size_t index = FacetBlocks::at(row, site);
      const auto known = knownSites(blocks, row, site);
      storeEstimate(growth.estimateFor(index, known), known, fit, index, memory.estimates);
    }
  }
  clearBorder(blocks, memory.estimates);
}

void storeFacets(const FacetBlocks& blocks, const FacetMemory& memory, const FacetMotion& motion,
                 const CellLimits& limits, const FacetSites& sites) {
  FacetRow rows[2];
  for (int row = 0; row < blocks.sites_down; ++row) {
    FacetRow& now = rows[row & 1];
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * sites.per_row;
    finishRow(blocks, memory, motion, row, now, sites.facet + first);
    if (row == 0) continue;
    const std::ptrdiff_t above = first - sites.per_row;
    classifyCells(rows[(row - 1) & 1], now, blocks.sites_across - 1, limits, sites.is_full + above,
                  sites.is_full + first, sites.cell + above);
  }
}

void facetsOf(const FacetBlocks& blocks, const FacetFit& fit, const FacetMemory& memory,
              const FacetMotion& motion, const CellLimits& limits, const FacetSites& sites) {
  fitSmallSupports(blocks, fit, memory);
  const auto reach = [](const Support& support) { return support.n * support.spacing; };
  if (kFifteen.side() <= fit.largest_plane) {
    meansOfBoxes<kFifteen.box>(blocks, reach(kFifteen), memory.row_sums, memory.mean_of_9);
  }
  if (kTwentyFive.side() <= fit.largest_plane) {
    meansOfBoxes<kTwentyFive.box>(blocks, reach(kTwentyFive), memory.row_sums, memory.mean_of_25);
  }
  estimateSites(blocks, fit, memory);
  storeFacets(blocks, memory, motion, limits, sites);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

FacetMemory::FacetMemory(int rows)
    : planes{},
      quadratics{},
      estimates{},
      row_sums(nullptr),
      mean_of_9(nullptr),
      mean_of_25(nullptr),
      floats_(kArrays * FacetBlocks::sizeFor(rows)),
      memory_(std::make_unique<float[]>(floats_)) {
  float** const arrays[] = {&planes.value,
                            &planes.slope_u,
                            &planes.slope_v,
                            &planes.cost,
                            &quadratics.value,
                            &quadratics.slope_u,
                            &quadratics.slope_v,
                            &quadratics.curvature_uu,
                            &quadratics.curvature_uv,
                            &quadratics.curvature_vv,
                            &quadratics.curved,
                            &quadratics.cost,
                            &estimates.value,
                            &estimates.slope_u,
                            &estimates.slope_v,
                            &estimates.curvature_uu,
                            &estimates.curvature_uv,
                            &estimates.curvature_vv,
                            &estimates.cubic_u,
                            &estimates.cubic_v,
                            &estimates.sigma,
                            &estimates.slope_sigma,
                            &estimates.curvature_sigma,
                            &row_sums,
                            &mean_of_9,
                            &mean_of_25};
  static_assert(std::size(arrays) == kArrays);
  float* next = memory_.get();
  for (float** const array : arrays) {
    *array = next;
    next += FacetBlocks::sizeFor(rows);
  }
}

HWY_EXPORT(facetsOf);

void fitFacets(const FacetBlocks& blocks, const FacetFit& fit, FacetMemory& memory, const FacetMotion& motion,
               const CellLimits& limits, const FacetSites& sites) noexcept {
  HWY_DYNAMIC_DISPATCH(facetsOf)(blocks, fit, memory, motion, limits, sites);
}

}  // namespace hapticd::rt
#endif
