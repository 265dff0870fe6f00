// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, after the kernel's includes and before its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_GROWTH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_GROWTH_INL_H_
#undef HAPTICD_RT_FACET_GROWTH_INL_H_
#else
#define HAPTICD_RT_FACET_GROWTH_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "rt/modelling/surface/facet_estimate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// Largest distance of each sample of a support from the current surface at which it still belongs to it.
template <const Support& kSupport>
struct Tolerance {
  static constexpr std::size_t kSide = 2 * static_cast<std::size_t>(kSupport.n) + 1;
  /// The uncertainty of slopes and curvatures matters within a block as well.
  static constexpr float kNearest = 1;
  float most[kSide][kSide];

  HWY_INLINE Tolerance(float at_site, float per_block, float per_square) {
    for (std::size_t j = 0; j < kSide; ++j) {
      for (std::size_t i = 0; i < kSide; ++i) {
        const auto u = (static_cast<float>(i) - kSupport.n) * kSupport.spacing;
        const auto v = (static_cast<float>(j) - kSupport.n) * kSupport.spacing;
        const float square = std::max(u * u + v * v, kNearest * kNearest);
        most[j][i] = at_site + per_block * std::sqrt(square) + per_square * square;
      }
    }
  }
};

/// Returns the tolerance used before slopes and curvatures are known; it admits a thin rod.
template <const Support& kSupport>
HWY_INLINE Tolerance<kSupport> firstTolerance(const FacetFit& fit) {
  constexpr float kMember_sigma = 3.5F;
  constexpr float kSlope = 0.35F;  // relative to a surface at 45 degrees
  const float slope = kSlope * fit.raw_per_block;
  return Tolerance<kSupport>(kMember_sigma * fit.noise_raw, slope, 0);
}

/// Returns the tolerance explained by the noise of a sample and by the uncertainty of an estimate on the
/// support `before`, plus a little for surfaces that are not quadratic.
template <const Support& kSupport>
HWY_INLINE Tolerance<kSupport> toleranceAfter(const Support& before, const FacetFit& fit) {
  constexpr float kMember_sigma = 3;
  constexpr float kSlope = 0.03F;
  const float most = kMember_sigma * pixelNoise(fit);
  // Next to an edge the samples are single blocks.
  const float sample = kThree.sample;
  return Tolerance<kSupport>(most * (sample + before.quadratic),
                             most * before.slope + kSlope * fit.raw_per_block, most * before.curvature);
}

/// Sums over a support of the residuals against the estimate, times 1, u, v, u^2, u v and v^2 in units of the
/// spacing, and the number of samples that belong to the surface.
struct Moments {
  Floats r, ru, rv, ruu, ruv, rvv;
  Floats count;
};

/// Part of a circle's fourth-order term that its slope causes, relative to the square of its third-order
/// term.
constexpr float kFourthOrder = 1.25F;

/// Computes the sums. `kCurved`: the estimate has curvature.
template <const Support& kSupport, bool kCurved>
HWY_INLINE Moments momentsOf(const float* samples, std::size_t index, const Tolerance<kSupport>& tolerance,
                             const Estimate& estimate, const Cubic& cubic) {
  constexpr int kN = kSupport.n;
  constexpr int kSpacing = kSupport.spacing;
  constexpr float kCurvatureOfBox = static_cast<float>(kSupport.box * kSupport.box - 1) / 12;
  Moments sums;
  sums.r = sums.ru = sums.rv = sums.ruu = sums.ruv = sums.rvv = sums.count = set(0);
  auto middle = estimate.value;
  if (kCurved)
    middle = hn::MulAdd(set(kCurvatureOfBox), hn::Add(estimate.curvature_uu, estimate.curvature_vv), middle);
  for (int j = -kN; j <= kN; ++j) {
    const auto dv = set(static_cast<float>(j * kSpacing));
    const auto plane = hn::MulAdd(dv, estimate.slope_v, middle);
    const auto curvature_start = hn::Mul(hn::Mul(dv, dv), estimate.curvature_vv);
    const auto curvature_slope = hn::Mul(dv, estimate.curvature_uv);
    const auto cubic_start = hn::Mul(dv, cubic.v);
    auto r = set(0);
    auto ru = set(0);
    auto ruu = set(0);
    for (int i = -kN; i <= kN; ++i) {
      const auto du = set(static_cast<float>(i * kSpacing));
      auto expected = hn::MulAdd(du, estimate.slope_u, plane);
      if (kCurved) {
        const auto curvature =
            hn::MulAdd(du, hn::MulAdd(du, estimate.curvature_uu, curvature_slope), curvature_start);
        const auto third = hn::MulAdd(du, cubic.u, cubic_start);
        const auto higher = hn::MulAdd(third, hn::MulAdd(set(kFourthOrder), third, set(1)), set(1));
        expected = hn::MulAdd(curvature, higher, expected);
      }
      const auto there = load(samples + moved(index, j * kSpacing, i * kSpacing));
      const auto residual = hn::Sub(there, expected);
      const auto near = hn::Le(hn::Abs(residual), set(tolerance.most[j + kN][i + kN]));
      const auto counts = hn::And(hn::Ge(there, set(0)), near);
      const auto kept = hn::IfThenElseZero(counts, residual);
      sums.count = hn::Add(sums.count, hn::IfThenElseZero(counts, set(1)));
      r = hn::Add(r, kept);
      ru = hn::MulAdd(kept, set(static_cast<float>(i)), ru);
      ruu = hn::MulAdd(kept, set(static_cast<float>(i * i)), ruu);
    }
    const auto v = set(static_cast<float>(j));
    sums.r = hn::Add(sums.r, r);
    sums.ru = hn::Add(sums.ru, ru);
    sums.ruu = hn::Add(sums.ruu, ruu);
    sums.rv = hn::MulAdd(r, v, sums.rv);
    sums.rvv = hn::MulAdd(r, hn::Mul(v, v), sums.rvv);
    sums.ruv = hn::MulAdd(ru, v, sums.ruv);
  }
  return sums;
}

/// Least-squares correction of the estimate by a support. A missing sample is replaced by the value that the
/// estimate predicts, so that sums always cover the complete square, on which the polynomials are orthogonal.
struct Change {
  Floats mean, slope_u, slope_v;
  Floats curvature_uu, curvature_uv, curvature_vv;
  Floats missing;  ///< factor by which missing samples increase the variances
};

/// Solves the least-squares problem for the sums of a support.
template <const Support& kSupport>
HWY_INLINE Change changeBy(const Moments& sums) {
  constexpr float kPerBlock = 1.0F / static_cast<float>(kSupport.spacing);
  constexpr float kSlope = kPerBlock / (kSupport.samples() * kSupport.m2());
  constexpr float kSpread = kSupport.m4() - kSupport.m2() * kSupport.m2();
  constexpr float kCurvature = kPerBlock * kPerBlock / (kSupport.samples() * kSpread);
  constexpr float kTwist = kPerBlock * kPerBlock / (kSupport.samples() * kSupport.m2() * kSupport.m2());
  const auto m2 = set(kSupport.m2());
  return {.mean = hn::Mul(sums.r, set(1 / kSupport.samples())),
          .slope_u = hn::Mul(sums.ru, set(kSlope)),
          .slope_v = hn::Mul(sums.rv, set(kSlope)),
          .curvature_uu = hn::Mul(hn::NegMulAdd(m2, sums.r, sums.ruu), set(kCurvature)),
          .curvature_uv = hn::Mul(sums.ruv, set(kTwist)),
          .curvature_vv = hn::Mul(hn::NegMulAdd(m2, sums.r, sums.rvv), set(kCurvature)),
          .missing = hn::Div(set(kSupport.samples()), hn::Max(sums.count, set(1)))};
}

/// Returns the degree of agreement between a larger and a smaller support, 1 to 0. It falls from 89 % to 99.9
/// % of the chi-square distribution (three degrees of freedom).
HWY_INLINE Floats agreement(Floats value, Floats slope_u, Floats slope_v, const Estimate& before) {
  const auto moved_by = hn::Div(squared(value), squared(before.sigma));
  const auto turned_by = hn::Div(hn::MulAdd(slope_u, slope_u, squared(slope_v)), squared(before.slope_sigma));
  return fallingStep(hn::Add(moved_by, turned_by), 6, 16);
}

/// Moves the estimate by the fraction `share` towards `to`.
HWY_INLINE void approach(Estimate& estimate, const Estimate& to, Floats share) {
  const auto step = [share](Floats& x, Floats end) { x = hn::MulAdd(share, hn::Sub(end, x), x); };
  step(estimate.value, to.value);
  step(estimate.slope_u, to.slope_u);
  step(estimate.slope_v, to.slope_v);
  step(estimate.curvature_uu, to.curvature_uu);
  step(estimate.curvature_uv, to.curvature_uv);
  step(estimate.curvature_vv, to.curvature_vv);
  step(estimate.sigma, to.sigma);
  step(estimate.slope_sigma, to.slope_sigma);
  step(estimate.curvature_sigma, to.curvature_sigma);
  step(estimate.value_by_curvature, to.value_by_curvature);
}

/// Moves the estimate towards a quadratic on a larger support, or a plane where that support is flat, as far
/// as both agree. `chain`: degree to which the estimate followed all smaller supports. `ready`: lanes to
/// leave unchanged.
template <const Support& kSupport>
HWY_INLINE void growCurved(const float* samples, std::size_t index, const FacetFit& fit,
                           const Tolerance<kSupport>& tolerance, Lanes ready, Estimate& estimate,
                           Floats& chain) {
  const Cubic cubic = cubicOf(estimate, fit, kSupport.reach());
  const Change change =
      changeBy<kSupport>(momentsOf<kSupport, true>(samples, index, tolerance, estimate, cubic));
  Estimate to;
  to.curvature_uu = hn::Add(estimate.curvature_uu, change.curvature_uu);
  to.curvature_uv = hn::Add(estimate.curvature_uv, change.curvature_uv);
  to.curvature_vv = hn::Add(estimate.curvature_vv, change.curvature_vv);
  const auto significance = significanceOf(to.curvature_uu, to.curvature_uv, to.curvature_vv, kSupport, fit);
  // At an edge, where samples are missing, curvature and slope are hard to separate.
  const auto cubed = hn::Mul(change.missing, squared(change.missing));
  const auto flat = flatShare(hn::Div(significance, cubed), kSupport.n == 1 ? kOfOthers : kOfSmall);
  const auto curved = hn::Sub(set(1), flat);
  to.curvature_uu = hn::Mul(curved, to.curvature_uu);
  to.curvature_uv = hn::Mul(curved, to.curvature_uv);
  to.curvature_vv = hn::Mul(curved, to.curvature_vv);
  const auto curvature = hn::Add(to.curvature_uu, to.curvature_vv);
  const auto more_curvature = hn::Sub(curvature, hn::Add(estimate.curvature_uu, estimate.curvature_vv));
  const auto value = hn::NegMulAdd(set(kSupport.valueByCurvature()), more_curvature, change.mean);
  // Replace the effect of the third-order term on the previous slopes by its effect on the new ones.
  to.slope_u = hn::Add(estimate.slope_u, change.slope_u);
  to.slope_v = hn::Add(estimate.slope_v, change.slope_v);
  const Cubic new_cubic = cubicOf(to, fit, kSupport.reach());
  const Turn turned = turnBy(cubic, estimate, kSupport);
  const Turn turns = turnBy(new_cubic, to, kSupport);
  const auto slope_u = hn::Sub(change.slope_u, hn::Sub(turns.u, turned.u));
  const auto slope_v = hn::Sub(change.slope_v, hn::Sub(turns.v, turned.v));
  // Where the estimate was a plane, remove the effect that the curvature had on it.
  constexpr float kM4ByM2 = 1.6F;  // in units of m2; the exact value is 1.5 to 1.8
  const auto by_curvature = estimate.value_by_curvature;
  const Turn plane_turned = turnBy(new_cubic, to, by_curvature, hn::Mul(set(kM4ByM2), by_curvature));
  const auto agreed = agreement(hn::MulAdd(by_curvature, curvature, value), hn::Add(slope_u, plane_turned.u),
                                hn::Add(slope_v, plane_turned.v), estimate);
  const float noise = pixelNoise(fit);
  const auto sigma =
      hn::MulAdd(curved, set(noise * (kSupport.quadratic - kSupport.plane)), set(noise * kSupport.plane));
  to.value = hn::Add(estimate.value, value);
  to.slope_u = hn::Add(estimate.slope_u, slope_u);
  to.slope_v = hn::Add(estimate.slope_v, slope_v);
  to.sigma = hn::Mul(change.missing, sigma);
  to.slope_sigma = hn::Mul(squared(change.missing), set(noise * kSupport.slope));
  to.curvature_sigma = hn::Mul(hn::Mul(change.missing, curved), set(noise * kSupport.curvature));
  to.value_by_curvature = hn::Mul(flat, set(kSupport.valueByCurvature()));
  const auto share = hn::Mul(chain, agreed);
  approach(estimate, to, hn::IfThenZeroElse(ready, share));
  chain = hn::IfThenElse(ready, chain, share);
}

/// Moves the estimate towards a plane on a larger support as far as that support is flat and both agree.
template <const Support& kSupport>
HWY_INLINE void growFlat(const float* samples, std::size_t index, const FacetFit& fit,
                         const Tolerance<kSupport>& tolerance, Estimate& estimate, Floats& chain) {
  const FloatTag df;
  const auto curvatures = hn::Or(hn::Or(estimate.curvature_uu, estimate.curvature_uv), estimate.curvature_vv);
  const bool is_flat = hn::AllTrue(df, hn::Eq(curvatures, set(0)));
  const Cubic cubic = cubicOf(estimate, fit, kSupport.reach());
  const Change change =
      changeBy<kSupport>(is_flat ? momentsOf<kSupport, false>(samples, index, tolerance, estimate, cubic)
                                 : momentsOf<kSupport, true>(samples, index, tolerance, estimate, cubic));
  const auto significance =
      significanceOf(hn::Add(estimate.curvature_uu, change.curvature_uu),
                     hn::Add(estimate.curvature_uv, change.curvature_uv),
                     hn::Add(estimate.curvature_vv, change.curvature_vv), kSupport, fit);
  const auto flat = flatShare(hn::Div(significance, change.missing), kOfOthers);
  const auto curvature = hn::Add(estimate.curvature_uu, estimate.curvature_vv);
  const auto value = hn::MulAdd(set(kSupport.valueByCurvature()), curvature, change.mean);
  const Turn turned = turnBy(cubic, estimate, kSupport);
  const auto slope_u = hn::Add(change.slope_u, turned.u);
  const auto slope_v = hn::Add(change.slope_v, turned.v);
  const auto agreed = agreement(value, slope_u, slope_v, estimate);
  const float noise = pixelNoise(fit);
  Estimate to;
  to.value = hn::Add(estimate.value, value);
  to.slope_u = hn::Add(estimate.slope_u, slope_u);
  to.slope_v = hn::Add(estimate.slope_v, slope_v);
  to.curvature_uu = to.curvature_uv = to.curvature_vv = to.curvature_sigma = set(0);
  to.sigma = hn::Mul(change.missing, set(noise * kSupport.plane));
  to.slope_sigma = hn::Mul(squared(change.missing), set(noise * kSupport.slope));
  to.value_by_curvature = set(kSupport.valueByCurvature());
  chain = hn::Mul(chain, hn::Mul(flat, agreed));
  approach(estimate, to, chain);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
