#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/facet_fit.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <cmath>

#include "hwy/highway.h"
#include "rt/facet_fit.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using Floats = hn::Vec<FloatTag>;

/// Surfaces steeper than that to the ray are taken for edges: there the sensor sees hardly anything either.
constexpr float kSteepestSlope = 3.7F;  // tan 75 degrees
constexpr float kNoPlane = 1e30F;
/// What a block may be off the surface so far and still count, in standard deviations.
constexpr float kMember_sigma = 3.5F;
/// And for each block of distance, in units of a 45 degree slope: what an estimate of the slope may be off.
constexpr float kMemberSlope = 0.35F;

HWY_INLINE Floats set(float value) {
  return hn::Set(FloatTag(), value);
}

/// 1 below `begin`, 0 from `end` on, and a smooth step between them.
HWY_INLINE Floats fallingStep(Floats x, float begin, float end) {
  const auto share = hn::Mul(hn::Sub(x, set(begin)), set(1 / (end - begin)));
  const auto t = hn::Min(hn::Max(share, set(0)), set(1));
  return hn::NegMulAdd(hn::Mul(t, t), hn::NegMulAdd(set(2), t, set(3)), set(1));
}

/// Sums of the normal equations of a plane over blocks at -1, 0 and 1.
class PlaneSums {
 public:
  // written out, so that it is compiled for the same instruction set as what it calls
  HWY_INLINE PlaneSums() { s_ = su_ = sv_ = suu_ = suv_ = svv_ = t_ = tu_ = tv_ = set(0); }

  HWY_INLINE void add(Floats weight, Floats difference, float du, float dv) {
    const auto weighted = hn::Mul(weight, difference);
    const auto u = set(du);
    const auto v = set(dv);
    s_ = hn::Add(s_, weight);
    su_ = hn::MulAdd(weight, u, su_);
    sv_ = hn::MulAdd(weight, v, sv_);
    suu_ = hn::MulAdd(weight, set(du * du), suu_);
    suv_ = hn::MulAdd(weight, set(du * dv), suv_);
    svv_ = hn::MulAdd(weight, set(dv * dv), svv_);
    t_ = hn::Add(t_, weighted);
    tu_ = hn::MulAdd(weighted, u, tu_);
    tv_ = hn::MulAdd(weighted, v, tv_);
  }

  /// Cramer's rule. The little that is added to the diagonal makes slopes that nothing determines zero.
  HWY_INLINE void solve(Floats& value, Floats& slope_u, Floats& slope_v) const {
    const auto ridge = hn::MulAdd(s_, set(1e-4F), set(1e-20F));
    const auto s = hn::Add(s_, set(1e-20F));
    const auto uu = hn::Add(suu_, ridge);
    const auto vv = hn::Add(svv_, ridge);
    const auto c_ss = hn::NegMulAdd(suv_, suv_, hn::Mul(uu, vv));
    const auto c_su = hn::NegMulAdd(su_, vv, hn::Mul(suv_, sv_));
    const auto c_sv = hn::NegMulAdd(sv_, uu, hn::Mul(su_, suv_));
    const auto determinant = hn::MulAdd(s, c_ss, hn::MulAdd(su_, c_su, hn::Mul(sv_, c_sv)));
    const auto c_uu = hn::NegMulAdd(sv_, sv_, hn::Mul(s, vv));
    const auto c_uv = hn::NegMulAdd(s, suv_, hn::Mul(su_, sv_));
    const auto c_vv = hn::NegMulAdd(su_, su_, hn::Mul(s, uu));
    const auto inverse = hn::Div(set(1), determinant);
    value = hn::Mul(inverse, hn::MulAdd(c_ss, t_, hn::MulAdd(c_su, tu_, hn::Mul(c_sv, tv_))));
    slope_u = hn::Mul(inverse, hn::MulAdd(c_su, t_, hn::MulAdd(c_uu, tu_, hn::Mul(c_uv, tv_))));
    slope_v = hn::Mul(inverse, hn::MulAdd(c_sv, t_, hn::MulAdd(c_uv, tu_, hn::Mul(c_vv, tv_))));
  }

  HWY_INLINE Floats count() const { return s_; }

 private:
  Floats s_, su_, sv_;
  Floats suu_, suv_, svv_;
  Floats t_, tu_, tv_;
};

HWY_INLINE std::size_t moved(std::size_t index, int rows, int columns) {
  return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(index) +
                                  rows * static_cast<std::ptrdiff_t>(FacetBlocks::kStride) + columns);
}

/// The plane over the 3 x 3 blocks around each of a vector of blocks.
HWY_INLINE void fitSmallPlane(const FacetBlocks& blocks, const FacetFit& fit, std::size_t index,
                              const SmallPlanes& out) {
  const FloatTag df;
  const auto own = hn::LoadU(df, blocks.disparity + index);
  const auto edge = set(6 * fit.noise_raw + kSteepestSlope * fit.raw_per_block);
  PlaneSums sums;
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const auto there = hn::LoadU(df, blocks.disparity + moved(index, dv, du));
      const auto difference = hn::Sub(there, own);
      const auto counts = hn::And(hn::Ge(there, set(0)), hn::Le(hn::Abs(difference), edge));
      sums.add(hn::IfThenElseZero(counts, set(1)), difference, static_cast<float>(du),
               static_cast<float>(dv));
    }
  }
  Floats value;
  Floats slope_u;
  Floats slope_v;
  sums.solve(value, slope_u, slope_v);
  auto squares = set(0);
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const auto there = hn::LoadU(df, blocks.disparity + moved(index, dv, du));
      const auto difference = hn::Sub(there, own);
      const auto counts = hn::And(hn::Ge(there, set(0)), hn::Le(hn::Abs(difference), edge));
      const auto plane = hn::MulAdd(slope_u, set(static_cast<float>(du)),
                                    hn::MulAdd(slope_v, set(static_cast<float>(dv)), value));
      const auto residual = hn::IfThenElseZero(counts, hn::Sub(difference, plane));
      squares = hn::MulAdd(residual, residual, squares);
    }
  }
  const auto missing = hn::Sub(set(9), sums.count());
  const auto freedom = hn::Max(hn::Sub(sums.count(), set(3)), set(0.5F));
  const auto cost =
      hn::MulAdd(missing, set(0.05F * fit.noise_raw * fit.noise_raw), hn::Div(squares, freedom));
  hn::StoreU(hn::Add(own, value), df, out.value + index);
  hn::StoreU(slope_u, df, out.per_column + index);
  hn::StoreU(slope_v, df, out.per_row + index);
  hn::StoreU(hn::IfThenElse(hn::Ge(own, set(0)), cost, set(kNoPlane)), df, out.cost + index);
}

/// The surface around a vector of sites so far: a quadratic in blocks from the site.
struct Estimate {
  Floats value, slope_u, slope_v;
  Floats bend_uu, bend_uv, bend_vv;
  Floats sigma;         ///< standard deviation of `value`
  Floats bias_of_bend;  ///< how far it is off where the surface bends, for each unit of the bend
  float half;           ///< of the support, blocks
};

/// The small plane of the site itself, or that of a neighbour which lies on a plane, fits much better and
/// predicts the site.
HWY_INLINE Estimate bestSmallPlane(const FacetBlocks& blocks, const FacetFit& fit, std::size_t index,
                                   const SmallPlanes& planes) {
  constexpr float kGoodFit_sigma = 0.6F;  // within 3 x 3 blocks the noise of neighbours is much the same
  constexpr float kMuchBetter = 0.4F;
  constexpr int kFarthest = 2;  // the planes of the next blocks hold the one on the crease
  const FloatTag df;
  const auto own = hn::LoadU(df, blocks.disparity + index);
  const auto own_cost = hn::LoadU(df, planes.cost + index);
  const auto good = set(kGoodFit_sigma * kGoodFit_sigma * fit.noise_raw * fit.noise_raw);
  const auto near = set(2.5F * fit.noise_raw + 0.5F * fit.raw_per_block);
  Estimate best;
  best.value = hn::LoadU(df, planes.value + index);
  best.slope_u = hn::LoadU(df, planes.per_column + index);
  best.slope_v = hn::LoadU(df, planes.per_row + index);
  auto least = hn::IfThenElseZero(hn::Gt(own_cost, good), hn::Mul(set(kMuchBetter), own_cost));
  if (!hn::AllTrue(df, hn::Le(least, set(0)))) {
    for (int dv = -kFarthest; dv <= kFarthest; ++dv) {
      for (int du = -kFarthest; du <= kFarthest; ++du) {
        const std::size_t neighbour = moved(index, dv, du);
        const auto cost = hn::LoadU(df, planes.cost + neighbour);
        const auto slope_u = hn::LoadU(df, planes.per_column + neighbour);
        const auto slope_v = hn::LoadU(df, planes.per_row + neighbour);
        const auto here = hn::NegMulAdd(
            slope_u, set(static_cast<float>(du)),
            hn::NegMulAdd(slope_v, set(static_cast<float>(dv)), hn::LoadU(df, planes.value + neighbour)));
        const auto fits = hn::And(hn::Lt(cost, least), hn::Le(cost, good));
        const auto better = hn::And(fits, hn::Le(hn::Abs(hn::Sub(here, own)), near));
        least = hn::IfThenElse(better, cost, least);
        best.value = hn::IfThenElse(better, here, best.value);
        best.slope_u = hn::IfThenElse(better, slope_u, best.slope_u);
        best.slope_v = hn::IfThenElse(better, slope_v, best.slope_v);
      }
    }
  }
  best.bend_uu = best.bend_uv = best.bend_vv = set(0);
  best.sigma = set(fit.noise_raw);
  best.half = 1.5F;
  best.bias_of_bend = set(2.0F / 3);
  return best;
}

/// A square support of (2 n + 1) x (2 n + 1) blocks that are `spacing` blocks apart.
struct Support {
  int n;
  int spacing;
  float side() const { return static_cast<float>(2 * n * spacing + 1); }
};

/// Sums of the residuals of a support against the estimate, times 1, u, v, u^2, u v and v^2 in units of the
/// spacing, and how many blocks count.
struct Moments {
  Floats r, ru, rv, ruu, ruv, rvv;
  Floats count;
};

HWY_INLINE Moments momentsOf(const FacetBlocks& blocks, const FacetFit& fit, std::size_t index,
                             const Support& support, const Estimate& estimate) {
  const FloatTag df;
  Moments sums;
  sums.r = sums.ru = sums.rv = sums.ruu = sums.ruv = sums.rvv = sums.count = set(0);
  for (int j = -support.n; j <= support.n; ++j) {
    const auto dv = static_cast<float>(j * support.spacing);
    const auto start =
        hn::MulAdd(set(dv), hn::MulAdd(set(dv), estimate.bend_vv, estimate.slope_v), estimate.value);
    const auto slope = hn::MulAdd(set(dv), estimate.bend_uv, estimate.slope_u);
    auto r = set(0);
    auto ru = set(0);
    auto ruu = set(0);
    for (int i = -support.n; i <= support.n; ++i) {
      const auto du = static_cast<float>(i * support.spacing);
      const auto there =
          hn::LoadU(df, blocks.disparity + moved(index, j * support.spacing, i * support.spacing));
      const auto expected = hn::MulAdd(set(du), hn::MulAdd(set(du), estimate.bend_uu, slope), start);
      const auto residual = hn::Sub(there, expected);
      const float distance = std::abs(du) > std::abs(dv) ? std::abs(du) : std::abs(dv);
      const float most = kMember_sigma * fit.noise_raw + kMemberSlope * fit.raw_per_block * distance;
      const auto counts = hn::And(hn::Ge(there, set(0)), hn::Le(hn::Abs(residual), set(most)));
      const auto kept = hn::IfThenElseZero(counts, residual);
      sums.count = hn::Add(sums.count, hn::IfThenElseZero(counts, set(1)));
      r = hn::Add(r, kept);
      ru = hn::MulAdd(kept, set(static_cast<float>(i)), ru);
      ruu = hn::MulAdd(kept, set(static_cast<float>(i * i)), ruu);
    }
    const auto v = static_cast<float>(j);
    sums.r = hn::Add(sums.r, r);
    sums.ru = hn::Add(sums.ru, ru);
    sums.ruu = hn::Add(sums.ruu, ruu);
    sums.rv = hn::MulAdd(r, set(v), sums.rv);
    sums.rvv = hn::MulAdd(r, set(v * v), sums.rvv);
    sums.ruv = hn::MulAdd(ru, set(v), sums.ruv);
  }
  return sums;
}

/// Moves the estimate to what a larger support says, as far as they agree. `chain`: how far it followed the
/// supports before. Blocks that do not count stand where the estimate expects them, so the sums are those of
/// a whole square, and the polynomials are orthogonal on it.
HWY_INLINE void grow(const FacetBlocks& blocks, const FacetFit& fit, std::size_t index,
                     const Support& support, Estimate& estimate, Floats& chain) {
  const Moments sums = momentsOf(blocks, fit, index, support, estimate);
  const auto n = static_cast<float>(support.n);
  const float number = (2 * n + 1) * (2 * n + 1);
  const float m2 = n * (n + 1) / 3;
  const float m4 = n * (n + 1) * (3 * n * n + 3 * n - 1) / 15;
  const float spread = m4 - m2 * m2;
  const float per_block = 1 / static_cast<float>(support.spacing);
  const float square = static_cast<float>(support.spacing) * static_cast<float>(support.spacing);
  const auto mean = hn::Mul(sums.r, set(1 / number));
  const auto slope_u = hn::Mul(sums.ru, set(per_block / (number * m2)));
  const auto slope_v = hn::Mul(sums.rv, set(per_block / (number * m2)));
  const auto more_uu = hn::Mul(hn::NegMulAdd(set(m2), sums.r, sums.ruu), set(1 / (number * spread)));
  const auto more_vv = hn::Mul(hn::NegMulAdd(set(m2), sums.r, sums.rvv), set(1 / (number * spread)));
  const auto more_uv = hn::Mul(sums.ruv, set(1 / (number * m2 * m2)));
  // The whole bend, in units of the spacing.
  const auto bend_uu = hn::MulAdd(estimate.bend_uu, set(square), more_uu);
  const auto bend_vv = hn::MulAdd(estimate.bend_vv, set(square), more_vv);
  const auto bend_uv = hn::MulAdd(estimate.bend_uv, set(square), more_uv);

  // Noise is shared by blocks that are nearer than nine pixels.
  const float apart_px = static_cast<float>(support.spacing * BlockLattice::kBlock_px) / 9;
  const float independent = apart_px < 1 ? apart_px * apart_px : 1;
  const auto samples = hn::Max(hn::Mul(sums.count, set(independent)), set(1));
  const auto plane_sigma = hn::Div(set(fit.noise_raw), hn::Sqrt(samples));
  const float bend_factor = m2 / std::sqrt(spread);
  const auto bend = hn::Mul(set(m2), hn::Max(hn::Abs(bend_uv), hn::Max(hn::Abs(bend_uu), hn::Abs(bend_vv))));
  const auto flat = fallingStep(hn::Div(bend, hn::Mul(set(bend_factor), plane_sigma)), 1.8F, 3.5F);

  const bool may_bend = support.side() <= fit.largest_quadratic;
  const auto curved = may_bend ? hn::Sub(set(1), flat) : set(0);
  const auto bent_value = hn::NegMulAdd(set(m2), hn::Add(more_uu, more_vv), mean);
  const auto flat_value = hn::MulAdd(set(m2 * square), hn::Add(estimate.bend_uu, estimate.bend_vv), mean);
  const auto value = hn::MulAdd(curved, hn::Sub(bent_value, flat_value), flat_value);

  auto agreed = may_bend ? set(1) : flat;
  const auto bias =
      hn::Mul(hn::Mul(curved, hn::Mul(estimate.bias_of_bend, set(1 / square))), hn::Add(bend_uu, bend_vv));
  const auto moved_by = hn::Div(hn::Abs(hn::Add(value, bias)), estimate.sigma);
  agreed = hn::Mul(agreed, fallingStep(moved_by, 1.5F, 3.0F));
  const auto turned_by = hn::Mul(hn::Add(hn::Abs(slope_u), hn::Abs(slope_v)), set(estimate.half / 1.7F));
  agreed = hn::Mul(agreed, fallingStep(hn::Div(turned_by, estimate.sigma), 2.0F, 4.0F));
  chain = hn::Mul(chain, agreed);

  const auto sigma = hn::MulAdd(curved, hn::Mul(plane_sigma, set(0.5F)), plane_sigma);
  estimate.value = hn::MulAdd(chain, value, estimate.value);
  estimate.slope_u = hn::MulAdd(chain, slope_u, estimate.slope_u);
  estimate.slope_v = hn::MulAdd(chain, slope_v, estimate.slope_v);
  const auto per_square = hn::Mul(curved, set(1 / square));
  estimate.bend_uu = hn::MulAdd(chain, hn::MulSub(per_square, bend_uu, estimate.bend_uu), estimate.bend_uu);
  estimate.bend_uv = hn::MulAdd(chain, hn::MulSub(per_square, bend_uv, estimate.bend_uv), estimate.bend_uv);
  estimate.bend_vv = hn::MulAdd(chain, hn::MulSub(per_square, bend_vv, estimate.bend_vv), estimate.bend_vv);
  estimate.sigma = hn::MulAdd(chain, hn::Sub(sigma, estimate.sigma), estimate.sigma);
  estimate.half = 0.5F * support.side();
  const auto next_bias = hn::Mul(hn::Sub(set(1), curved), set(m2 * square));
  estimate.bias_of_bend = hn::MulAdd(chain, hn::Sub(next_bias, estimate.bias_of_bend), estimate.bias_of_bend);
}

void facetsOf(const FacetBlocks& blocks, const FacetFit& fit, const SmallPlanes& planes, Facet* facets) {
  constexpr int kRing = 2;  // of neighbours whose planes are looked at
  constexpr Support kSupports[] = {{1, 1}, {2, 1}, {3, 1}, {3, 2}, {3, 3}, {3, 4}};
  const FloatTag df;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  for (int row = -kRing; row < blocks.sites_down + kRing; ++row) {
    for (int site = -kRing; site < blocks.sites_across + kRing; site += lanes) {
      fitSmallPlane(blocks, fit, FacetBlocks::at(row, site), planes);
    }
  }
  for (int row = 0; row < blocks.sites_down; ++row) {
    for (int site = 0; site < blocks.sites_across; site += lanes) {
      const std::size_t index = FacetBlocks::at(row, site);
      Estimate estimate = bestSmallPlane(blocks, fit, index, planes);
      auto chain = set(1);
      for (const Support& support : kSupports) {
        if (support.side() > fit.largest_plane || hn::AllTrue(df, hn::Le(chain, set(0)))) break;
        grow(blocks, fit, index, support, estimate, chain);
      }
      // A block's mean lies off its middle by the bend within it.
      constexpr float kSide = BlockLattice::kBlock_px;
      constexpr float kBendOfMean = (kSide * kSide - 1) / (12 * kSide * kSide);
      estimate.value =
          hn::NegMulAdd(set(kBendOfMean), hn::Add(estimate.bend_uu, estimate.bend_vv), estimate.value);
      const auto known = hn::Ge(hn::LoadU(df, blocks.disparity + index), set(0));
      const float per_px = 1.0F / BlockLattice::kBlock_px;
      HWY_ALIGN float value[hn::MaxLanes(df)];
      HWY_ALIGN float per_column[hn::MaxLanes(df)];
      HWY_ALIGN float per_row[hn::MaxLanes(df)];
      hn::Store(hn::IfThenElse(known, estimate.value, set(-1)), df, value);
      hn::Store(hn::Mul(estimate.slope_u, set(per_px)), df, per_column);
      hn::Store(hn::Mul(estimate.slope_v, set(per_px)), df, per_row);
      const int count = blocks.sites_across - site < lanes ? blocks.sites_across - site : lanes;
      Facet* const out = facets + BlockLattice::at(row, site);
      for (int i = 0; i < count; ++i) out[i] = {value[i], per_column[i], per_row[i], out[i].per_second};
    }
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(facetsOf);

void fitFacets(const FacetBlocks& blocks, const FacetFit& fit, const SmallPlanes& work,
               Facet* facets) noexcept {
  HWY_DYNAMIC_DISPATCH(facetsOf)(blocks, fit, work, facets);
}

}  // namespace hapticd::rt
#endif
