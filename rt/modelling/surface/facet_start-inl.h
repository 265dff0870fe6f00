// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, after the kernel's includes and before its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_START_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_START_INL_H_
#undef HAPTICD_RT_FACET_START_INL_H_
#else
#define HAPTICD_RT_FACET_START_INL_H_
#endif

#include "rt/modelling/surface/facet_estimate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// Steeper surfaces are treated as edges; the sensor measures hardly anything there.
constexpr float kSteepestSlope = 3.7F;  // tan 75 degrees
constexpr float kNoFit = 1e30F;
/// Neighbours up to this many blocks away are considered, because the planes of adjacent blocks include the
/// one on the crease.
constexpr int kRing = 2;
/// Residuals of good fits, in standard deviations of a block's mean. Within 3 x 3 blocks the noise is
/// strongly correlated; residuals of 5 x 5 blocks have 0.29 of a pixel's variance, with an equally large
/// spread.
constexpr float kGoodPlane_sigma = 0.6F;
constexpr float kGoodQuadratic = 0.73F;  // relative to a pixel's variance

/// Variance of a plane's value and slopes as a fraction of the mean square of its residuals.
constexpr float kMisfit = 0.3F;

HWY_INLINE float goodPlane(const FacetFit& fit) {
  return kGoodPlane_sigma * kGoodPlane_sigma * fit.noise_raw * fit.noise_raw;
}

/// Returns the lanes of sites that prefer the plane or quadratic of a neighbour to their own plane.
HWY_INLINE Lanes needsNeighbours(const FacetFit& fit, std::size_t index, const FacetMemory::Planes& planes) {
  return hn::Gt(load(planes.cost + index), set(goodPlane(fit)));
}

HWY_INLINE float goodQuadratic(const FacetFit& fit) {
  return kGoodQuadratic * pixelNoise(fit) * pixelNoise(fit);
}

/// Normal equations of a plane over blocks at offsets -1, 0 and 1.
class PlaneSums {
 public:
  // defined here so that it is compiled for the same instruction set as the functions it calls
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

  /// Solves the equations by Cramer's rule. A small term on the diagonal makes undetermined slopes zero.
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

/// Fits a plane to the 3 x 3 blocks around each of a vector of blocks.
HWY_INLINE void fitSmallPlane(const FacetBlocks& blocks, const FacetFit& fit, std::size_t index,
                              const FacetMemory::Planes& out) {
  const auto own = load(blocks.disparity + index);
  const auto edge = set(6 * fit.noise_raw + kSteepestSlope * fit.raw_per_block);
  PlaneSums sums;
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const auto there = load(blocks.disparity + moved(index, dv, du));
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
      const auto there = load(blocks.disparity + moved(index, dv, du));
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
  const auto cost = hn::MulAdd(missing, set(0.5F * fit.noise_raw * fit.noise_raw), hn::Div(squares, freedom));
  store(hn::Add(own, value), out.value + index);
  store(slope_u, out.slope_u + index);
  store(slope_v, out.slope_v + index);
  store(hn::IfThenElse(hn::Ge(own, set(0)), cost, set(kNoFit)), out.cost + index);
}

/// Fits a quadratic to the 5 x 5 blocks around each of a vector of blocks, or a plane where they are flat.
/// Returns the lanes with a good fit.
HWY_INLINE Lanes fitSmallQuadratic(const FacetBlocks& blocks, const FacetFit& fit, std::size_t index,
                                   const FacetMemory::Quadratics& out) {
  const auto own = load(blocks.disparity + index);
  auto s = set(0);
  auto su = set(0);
  auto sv = set(0);
  auto suu = set(0);
  auto suv = set(0);
  auto svv = set(0);
  auto squares = set(0);
  auto least = set(0);
  for (int j = -2; j <= 2; ++j) {
    const float* const row = blocks.disparity + moved(index, j, 0);
    const auto outer_left = load(row - 2);
    const auto left = load(row - 1);
    const auto middle = load(row);
    const auto right = load(row + 1);
    const auto outer_right = load(row + 2);
    least = hn::Min(least, hn::Min(hn::Min(outer_left, outer_right), hn::Min(middle, hn::Min(left, right))));
    const auto a = hn::Sub(outer_left, own);
    const auto b = hn::Sub(left, own);
    const auto c = hn::Sub(middle, own);
    const auto d = hn::Sub(right, own);
    const auto e = hn::Sub(outer_right, own);
    const auto inner = hn::Add(b, d);
    const auto outer = hn::Add(a, e);
    const auto r = hn::Add(c, hn::Add(inner, outer));
    const auto ru = hn::MulAdd(set(2), hn::Sub(e, a), hn::Sub(d, b));
    const auto v = static_cast<float>(j);
    s = hn::Add(s, r);
    su = hn::Add(su, ru);
    suu = hn::Add(suu, hn::MulAdd(set(4), outer, inner));
    sv = hn::MulAdd(set(v), r, sv);
    svv = hn::MulAdd(set(v * v), r, svv);
    suv = hn::MulAdd(set(v), ru, suv);
    squares =
        hn::Add(squares, hn::MulAdd(a, a, hn::MulAdd(b, b, hn::MulAdd(c, c, hn::MulAdd(d, d, squared(e))))));
  }
  // The polynomials 1, u, v, u^2 - 2, v^2 - 2 and u v are orthogonal on the square.
  const auto mean = hn::Mul(s, set(1.0F / 25));
  const auto slope_u = hn::Mul(su, set(1.0F / 50));
  const auto slope_v = hn::Mul(sv, set(1.0F / 50));
  const auto along_uu = hn::NegMulAdd(set(2), s, suu);
  const auto along_vv = hn::NegMulAdd(set(2), s, svv);
  const auto uu = hn::Mul(along_uu, set(1.0F / 70));
  const auto vv = hn::Mul(along_vv, set(1.0F / 70));
  const auto uv = hn::Mul(suv, set(1.0F / 100));
  const auto by_curvature = hn::MulAdd(uu, along_uu, hn::MulAdd(vv, along_vv, hn::Mul(uv, suv)));
  const auto explained = hn::MulAdd(mean, s, hn::MulAdd(slope_u, su, hn::MulAdd(slope_v, sv, by_curvature)));
  constexpr float kFreedom = 19;
  const auto cost = hn::Mul(hn::Sub(squares, explained), set(1 / kFreedom));
  const auto curved = hn::Sub(set(1), flatShare(significanceOf(uu, uv, vv, kFive, fit), kOfSmall));
  const auto value = hn::NegMulAdd(set(kFive.valueByCurvature()), hn::Mul(curved, hn::Add(uu, vv)), mean);
  store(hn::Add(own, value), out.value + index);
  store(slope_u, out.slope_u + index);
  store(slope_v, out.slope_v + index);
  store(hn::Mul(curved, uu), out.curvature_uu + index);
  store(hn::Mul(curved, uv), out.curvature_uv + index);
  store(hn::Mul(curved, vv), out.curvature_vv + index);
  store(curved, out.curved + index);
  const auto known = hn::IfThenElse(hn::Ge(least, set(0)), cost, set(kNoFit));
  store(known, out.cost + index);
  return hn::Le(known, set(goodQuadratic(fit)));
}

/// Returns the initial estimate from a site's own blocks: the quadratic if it fits well (lanes
/// `by_quadratic`), otherwise the plane.
HWY_INLINE Estimate ownStart(const FacetFit& fit, std::size_t index, const FacetMemory& memory,
                             Lanes& by_quadratic) {
  const float noise = pixelNoise(fit);
  const auto& quadratics = memory.quadratics;
  const auto& planes = memory.planes;
  by_quadratic = hn::Le(load(quadratics.cost + index), set(goodQuadratic(fit)));
  const auto either = [&](const float* quadratic, const float* plane) {
    return hn::IfThenElse(by_quadratic, load(quadratic + index), load(plane + index));
  };
  const auto curvature = [&](const float* quadratic) {
    return hn::IfThenElseZero(by_quadratic, load(quadratic + index));
  };
  const auto curved = load(quadratics.curved + index);
  const auto sigma =
      hn::MulAdd(curved, set(noise * (kFive.quadratic - kFive.plane)), set(noise * kFive.plane));
  Estimate own;
  own.value = either(quadratics.value, planes.value);
  own.slope_u = either(quadratics.slope_u, planes.slope_u);
  own.slope_v = either(quadratics.slope_v, planes.slope_v);
  own.curvature_uu = curvature(quadratics.curvature_uu);
  own.curvature_uv = curvature(quadratics.curvature_uv);
  own.curvature_vv = curvature(quadratics.curvature_vv);
  const Turn turn = turnBy(cubicOf(own, fit, kFive.reach()), own, kFive);
  own.slope_u = hn::Sub(own.slope_u, turn.u);
  own.slope_v = hn::Sub(own.slope_v, turn.v);
  const auto misfit = hn::Mul(set(kMisfit), load(planes.cost + index));
  const auto with_misfit = [misfit](float of_noise) {
    return hn::Sqrt(hn::Add(misfit, set(of_noise * of_noise)));
  };
  own.sigma = hn::IfThenElse(by_quadratic, sigma, with_misfit(noise * kThree.plane));
  own.slope_sigma = hn::IfThenElse(by_quadratic, set(noise * kFive.slope), with_misfit(noise * kThree.slope));
  own.curvature_sigma = hn::IfThenElse(by_quadratic, hn::Mul(curved, set(noise * kFive.curvature)),
                                       set(noise * kThree.curvature));
  own.value_by_curvature = hn::IfThenElse(
      by_quadratic, hn::NegMulAdd(curved, set(kFive.valueByCurvature()), set(kFive.valueByCurvature())),
      set(kThree.valueByCurvature()));
  return own;
}

/// Where a site's own plane does not fit, takes that of a neighbour which fits much better and predicts the
/// site. `least`: the cost to improve on.
HWY_INLINE void takePlaneOfNeighbour(const FacetFit& fit, std::size_t index, Floats own,
                                     const FacetMemory::Planes& planes, Floats least, Estimate& best) {
  const auto good = set(goodPlane(fit));
  const auto near = set(2.5F * fit.noise_raw + 0.5F * fit.raw_per_block);
  // Away from the middle of a support, estimates are less certain.
  constexpr float kSigma = 0.9F;
  constexpr float kSlopeSigma = 0.6F;
  const auto sigma = set(pixelNoise(fit) * kSigma);
  const auto slope_sigma = set(pixelNoise(fit) * kSlopeSigma);
  for (int dv = -kRing; dv <= kRing; ++dv) {
    for (int du = -kRing; du <= kRing; ++du) {
      const std::size_t neighbour = moved(index, dv, du);
      const auto cost = load(planes.cost + neighbour);
      const auto slope_u = load(planes.slope_u + neighbour);
      const auto slope_v = load(planes.slope_v + neighbour);
      const auto along_v =
          hn::NegMulAdd(slope_v, set(static_cast<float>(dv)), load(planes.value + neighbour));
      const auto here = hn::NegMulAdd(slope_u, set(static_cast<float>(du)), along_v);
      const auto fits = hn::And(hn::Lt(cost, least), hn::Le(cost, good));
      const auto better = hn::And(fits, hn::Le(hn::Abs(hn::Sub(here, own)), near));
      least = hn::IfThenElse(better, cost, least);
      best.value = hn::IfThenElse(better, here, best.value);
      best.slope_u = hn::IfThenElse(better, slope_u, best.slope_u);
      best.slope_v = hn::IfThenElse(better, slope_v, best.slope_v);
      best.sigma = hn::IfThenElse(better, sigma, best.sigma);
      best.slope_sigma = hn::IfThenElse(better, slope_sigma, best.slope_sigma);
    }
  }
}

/// Prefers the quadratic of a neighbour that fits well and whose 5 x 5 blocks include the site.
HWY_INLINE void takeQuadraticOfNeighbour(const FacetFit& fit, std::size_t index, Floats own,
                                         const FacetMemory::Quadratics& quadratics, Floats least,
                                         Estimate& best) {
  // Away from the middle of a support, estimates are less certain.
  constexpr float kSigma = 1.3F;
  constexpr float kSlopeSigma = 0.5F;
  const float noise = pixelNoise(fit);
  const auto near = set(2 * fit.noise_raw);
  for (int dv = -kRing; dv <= kRing; ++dv) {
    for (int du = -kRing; du <= kRing; ++du) {
      if (((du + dv) & 1) != 0) continue;  // adjacent ones are nearly the same
      const std::size_t neighbour = moved(index, dv, du);
      const auto cost = load(quadratics.cost + neighbour);
      const auto uu = load(quadratics.curvature_uu + neighbour);
      const auto uv = load(quadratics.curvature_uv + neighbour);
      const auto vv = load(quadratics.curvature_vv + neighbour);
      const auto u = set(static_cast<float>(-du));
      const auto v = set(static_cast<float>(-dv));
      // Half the change of the slopes on the way to the site.
      const auto half_u = hn::MulAdd(uu, u, hn::Mul(set(-0.5F * static_cast<float>(dv)), uv));
      const auto half_v = hn::MulAdd(vv, v, hn::Mul(set(-0.5F * static_cast<float>(du)), uv));
      const auto middle_u = hn::Add(load(quadratics.slope_u + neighbour), half_u);
      const auto middle_v = hn::Add(load(quadratics.slope_v + neighbour), half_v);
      const auto here = hn::MulAdd(middle_u, u, hn::MulAdd(middle_v, v, load(quadratics.value + neighbour)));
      const auto better = hn::And(hn::Lt(cost, least), hn::Le(hn::Abs(hn::Sub(here, own)), near));
      least = hn::IfThenElse(better, cost, least);
      best.value = hn::IfThenElse(better, here, best.value);
      best.slope_u = hn::IfThenElse(better, hn::Add(middle_u, half_u), best.slope_u);
      best.slope_v = hn::IfThenElse(better, hn::Add(middle_v, half_v), best.slope_v);
      best.curvature_uu = hn::IfThenElse(better, uu, best.curvature_uu);
      best.curvature_uv = hn::IfThenElse(better, uv, best.curvature_uv);
      best.curvature_vv = hn::IfThenElse(better, vv, best.curvature_vv);
      best.sigma = hn::IfThenElse(better, set(kSigma * noise), best.sigma);
      best.slope_sigma = hn::IfThenElse(better, set(kSlopeSigma * noise), best.slope_sigma);
      best.curvature_sigma = hn::IfThenElse(better, set(kFive.curvature * noise), best.curvature_sigma);
      best.value_by_curvature = hn::IfThenElse(better, set(0), best.value_by_curvature);
    }
  }
}

/// Returns the initial estimates of a vector of sites, of which only `requested` are meaningful. `ready`:
/// lanes that need no support of up to 5 x 5 blocks. `taken`: those and the lanes taken from a neighbour,
/// which the 3 x 3 blocks around a site whose own plane does not fit must not curve.
HWY_INLINE Estimate startOf(const FacetBlocks& blocks, const FacetFit& fit, std::size_t index,
                            const FacetMemory& memory, Lanes requested, Lanes& ready, Lanes& taken) {
  constexpr float kMuchBetter = 0.4F;
  const FloatTag df;
  Estimate best = ownStart(fit, index, memory, ready);
  ready = hn::Or(ready, hn::Not(requested));
  taken = ready;
  if (hn::AllTrue(df, ready)) return best;
  const auto cost = load(memory.planes.cost + index);
  const auto searches = hn::AndNot(ready, needsNeighbours(fit, index, memory.planes));
  if (hn::AllFalse(df, searches)) return best;
  const auto own = load(blocks.disparity + index);
  const auto before = best.value;
  takePlaneOfNeighbour(fit, index, own, memory.planes,
                       hn::IfThenElseZero(searches, hn::Mul(set(kMuchBetter), cost)), best);
  takeQuadraticOfNeighbour(fit, index, own, memory.quadratics,
                           hn::IfThenElseZero(searches, set(goodQuadratic(fit))), best);
  taken = hn::Or(ready, hn::Not(hn::Eq(before, best.value)));
  return best;
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
