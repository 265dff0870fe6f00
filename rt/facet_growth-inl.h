// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, from between the kernel's includes and its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_GROWTH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_GROWTH_INL_H_
#undef HAPTICD_RT_FACET_GROWTH_INL_H_
#else
#define HAPTICD_RT_FACET_GROWTH_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "rt/facet_estimate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// What each sample of a support may be off the surface so far and still count.
template <const Support& kSupport>
struct Tolerance {
  static constexpr std::size_t kSide = 2 * static_cast<std::size_t>(kSupport.n) + 1;
  /// What is unknown of a slope or bend matters within a block, too.
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

/// Before anything is known of slopes and bends: of what may be a thin rod.
template <const Support& kSupport>
HWY_INLINE Tolerance<kSupport> firstTolerance(const FacetFit& fit) {
  constexpr float kMember_sigma = 3.5F;
  constexpr float kSlope = 0.35F;  // of a surface at 45 degrees
  const float slope = kSlope * fit.raw_per_block;
  return Tolerance<kSupport>(kMember_sigma * fit.noise_raw, slope, 0);
}

/// What noise explains of a sample of the support and of an estimate from the one `before`, and a little for
/// surfaces that are no quadratic.
template <const Support& kSupport>
HWY_INLINE Tolerance<kSupport> toleranceAfter(const Support& before, const FacetFit& fit) {
  constexpr float kMember_sigma = 3;
  constexpr float kSlope = 0.03F;
  const float most = kMember_sigma * pixelNoise(fit);
  // Beside an edge the samples are single blocks.
  const float sample = kThree.sample;
  return Tolerance<kSupport>(most * (sample + before.quadratic),
                             most * before.slope + kSlope * fit.raw_per_block, most * before.bend);
}

/// Sums of the residuals of a support against the estimate, times 1, u, v, u^2, u v and v^2 in units of the
/// spacing, and how many samples count.
struct Moments {
  Floats r, ru, rv, ruu, ruv, rvv;
  Floats count;
};

/// Of a circle's fourth order that part which its slope makes, by the square of its third.
constexpr float kFourthOrder = 1.25F;

/// `kBent`: the estimate has bends.
template <const Support& kSupport, bool kBent>
HWY_INLINE Moments momentsOf(const float* samples, std::size_t index, const Tolerance<kSupport>& tolerance,
                             const Estimate& estimate, const Cubic& cubic) {
  constexpr int kN = kSupport.n;
  constexpr int kSpacing = kSupport.spacing;
  constexpr float kBendOfBox = static_cast<float>(kSupport.box * kSupport.box - 1) / 12;
  Moments sums;
  sums.r = sums.ru = sums.rv = sums.ruu = sums.ruv = sums.rvv = sums.count = set(0);
  auto middle = estimate.value;
  if (kBent) middle = hn::MulAdd(set(kBendOfBox), hn::Add(estimate.bend_uu, estimate.bend_vv), middle);
  for (int j = -kN; j <= kN; ++j) {
    const auto dv = set(static_cast<float>(j * kSpacing));
    const auto plane = hn::MulAdd(dv, estimate.slope_v, middle);
    const auto bend_start = hn::Mul(hn::Mul(dv, dv), estimate.bend_vv);
    const auto bend_slope = hn::Mul(dv, estimate.bend_uv);
    const auto cubic_start = hn::Mul(dv, cubic.v);
    auto r = set(0);
    auto ru = set(0);
    auto ruu = set(0);
    for (int i = -kN; i <= kN; ++i) {
      const auto du = set(static_cast<float>(i * kSpacing));
      auto expected = hn::MulAdd(du, estimate.slope_u, plane);
      if (kBent) {
        const auto bend = hn::MulAdd(du, hn::MulAdd(du, estimate.bend_uu, bend_slope), bend_start);
        const auto third = hn::MulAdd(du, cubic.u, cubic_start);
        const auto higher = hn::MulAdd(third, hn::MulAdd(set(kFourthOrder), third, set(1)), set(1));
        expected = hn::MulAdd(bend, higher, expected);
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

/// What a support adds to the estimate, by least squares. Samples that do not count stand where the estimate
/// expects them, so the sums are those of a whole square, and the polynomials are orthogonal on it.
struct Change {
  Floats mean, slope_u, slope_v;
  Floats bend_uu, bend_uv, bend_vv;
  Floats missing;  ///< how much larger the variances are, because samples do not count
};

template <const Support& kSupport>
HWY_INLINE Change changeBy(const Moments& sums) {
  constexpr float kPerBlock = 1.0F / static_cast<float>(kSupport.spacing);
  constexpr float kSlope = kPerBlock / (kSupport.samples() * kSupport.m2());
  constexpr float kSpread = kSupport.m4() - kSupport.m2() * kSupport.m2();
  constexpr float kBend = kPerBlock * kPerBlock / (kSupport.samples() * kSpread);
  constexpr float kTwist = kPerBlock * kPerBlock / (kSupport.samples() * kSupport.m2() * kSupport.m2());
  const auto m2 = set(kSupport.m2());
  return {.mean = hn::Mul(sums.r, set(1 / kSupport.samples())),
          .slope_u = hn::Mul(sums.ru, set(kSlope)),
          .slope_v = hn::Mul(sums.rv, set(kSlope)),
          .bend_uu = hn::Mul(hn::NegMulAdd(m2, sums.r, sums.ruu), set(kBend)),
          .bend_uv = hn::Mul(sums.ruv, set(kTwist)),
          .bend_vv = hn::Mul(hn::NegMulAdd(m2, sums.r, sums.rvv), set(kBend)),
          .missing = hn::Div(set(kSupport.samples()), hn::Max(sums.count, set(1)))};
}

/// How far larger and smaller support agree, 1 to 0: by the chi-square of three numbers where they do, from
/// 89 % to 99.9 %.
HWY_INLINE Floats agreement(Floats value, Floats slope_u, Floats slope_v, const Estimate& before) {
  const auto moved_by = hn::Div(squared(value), squared(before.sigma));
  const auto turned_by = hn::Div(hn::MulAdd(slope_u, slope_u, squared(slope_v)), squared(before.slope_sigma));
  return fallingStep(hn::Add(moved_by, turned_by), 6, 16);
}

/// Moves the estimate by `share` towards `to`.
HWY_INLINE void approach(Estimate& estimate, const Estimate& to, Floats share) {
  const auto step = [share](Floats& x, Floats end) { x = hn::MulAdd(share, hn::Sub(end, x), x); };
  step(estimate.value, to.value);
  step(estimate.slope_u, to.slope_u);
  step(estimate.slope_v, to.slope_v);
  step(estimate.bend_uu, to.bend_uu);
  step(estimate.bend_uv, to.bend_uv);
  step(estimate.bend_vv, to.bend_vv);
  step(estimate.sigma, to.sigma);
  step(estimate.slope_sigma, to.slope_sigma);
  step(estimate.bend_sigma, to.bend_sigma);
  step(estimate.value_by_bend, to.value_by_bend);
}

/// Moves the estimate to what a quadratic on a larger support says, or a plane where that is flat, as far as
/// they agree. `chain`: how far it followed the supports before. `ready`: those that stay.
template <const Support& kSupport>
HWY_INLINE void growCurved(const float* samples, std::size_t index, const FacetFit& fit,
                           const Tolerance<kSupport>& tolerance, Lanes ready, Estimate& estimate,
                           Floats& chain) {
  const Cubic cubic = cubicOf(estimate, fit, kSupport.reach());
  const Change change =
      changeBy<kSupport>(momentsOf<kSupport, true>(samples, index, tolerance, estimate, cubic));
  Estimate to;
  to.bend_uu = hn::Add(estimate.bend_uu, change.bend_uu);
  to.bend_uv = hn::Add(estimate.bend_uv, change.bend_uv);
  to.bend_vv = hn::Add(estimate.bend_vv, change.bend_vv);
  const auto significance = significanceOf(to.bend_uu, to.bend_uv, to.bend_vv, kSupport, fit);
  // At an edge, where samples are missing, bends and slopes are hard to tell from each other.
  const auto cubed = hn::Mul(change.missing, squared(change.missing));
  const auto flat = flatShare(hn::Div(significance, cubed), kSupport.n == 1 ? kOfOthers : kOfSmall);
  const auto curved = hn::Sub(set(1), flat);
  to.bend_uu = hn::Mul(curved, to.bend_uu);
  to.bend_uv = hn::Mul(curved, to.bend_uv);
  to.bend_vv = hn::Mul(curved, to.bend_vv);
  const auto bend = hn::Add(to.bend_uu, to.bend_vv);
  const auto more_bend = hn::Sub(bend, hn::Add(estimate.bend_uu, estimate.bend_vv));
  const auto value = hn::NegMulAdd(set(kSupport.valueByBend()), more_bend, change.mean);
  // By how much the third order turned the slopes before, and turns them now.
  to.slope_u = hn::Add(estimate.slope_u, change.slope_u);
  to.slope_v = hn::Add(estimate.slope_v, change.slope_v);
  const Cubic new_cubic = cubicOf(to, fit, kSupport.reach());
  const Turn turned = turnBy(cubic, estimate, kSupport);
  const Turn turns = turnBy(new_cubic, to, kSupport);
  const auto slope_u = hn::Sub(change.slope_u, hn::Sub(turns.u, turned.u));
  const auto slope_v = hn::Sub(change.slope_v, hn::Sub(turns.v, turned.v));
  // Where the estimate was a plane, this is what the bends had made of it.
  constexpr float kM4ByM2 = 1.6F;  // over m2; it is 1.5 to 1.8
  const auto by_bend = estimate.value_by_bend;
  const Turn plane_turned = turnBy(new_cubic, to, by_bend, hn::Mul(set(kM4ByM2), by_bend));
  const auto agreed = agreement(hn::MulAdd(by_bend, bend, value), hn::Add(slope_u, plane_turned.u),
                                hn::Add(slope_v, plane_turned.v), estimate);
  const float noise = pixelNoise(fit);
  const auto sigma =
      hn::MulAdd(curved, set(noise * (kSupport.quadratic - kSupport.plane)), set(noise * kSupport.plane));
  to.value = hn::Add(estimate.value, value);
  to.slope_u = hn::Add(estimate.slope_u, slope_u);
  to.slope_v = hn::Add(estimate.slope_v, slope_v);
  to.sigma = hn::Mul(change.missing, sigma);
  to.slope_sigma = hn::Mul(squared(change.missing), set(noise * kSupport.slope));
  to.bend_sigma = hn::Mul(hn::Mul(change.missing, curved), set(noise * kSupport.bend));
  to.value_by_bend = hn::Mul(flat, set(kSupport.valueByBend()));
  const auto share = hn::Mul(chain, agreed);
  approach(estimate, to, hn::IfThenZeroElse(ready, share));
  chain = hn::IfThenElse(ready, chain, share);
}

/// The same with a plane, as far as the support is flat.
template <const Support& kSupport>
HWY_INLINE void growFlat(const float* samples, std::size_t index, const FacetFit& fit,
                         const Tolerance<kSupport>& tolerance, Estimate& estimate, Floats& chain) {
  const FloatTag df;
  const auto bends = hn::Or(hn::Or(estimate.bend_uu, estimate.bend_uv), estimate.bend_vv);
  const bool is_flat = hn::AllTrue(df, hn::Eq(bends, set(0)));
  const Cubic cubic = cubicOf(estimate, fit, kSupport.reach());
  const Change change =
      changeBy<kSupport>(is_flat ? momentsOf<kSupport, false>(samples, index, tolerance, estimate, cubic)
                                 : momentsOf<kSupport, true>(samples, index, tolerance, estimate, cubic));
  const auto significance =
      significanceOf(hn::Add(estimate.bend_uu, change.bend_uu), hn::Add(estimate.bend_uv, change.bend_uv),
                     hn::Add(estimate.bend_vv, change.bend_vv), kSupport, fit);
  const auto flat = flatShare(hn::Div(significance, change.missing), kOfOthers);
  const auto bend = hn::Add(estimate.bend_uu, estimate.bend_vv);
  const auto value = hn::MulAdd(set(kSupport.valueByBend()), bend, change.mean);
  const Turn turned = turnBy(cubic, estimate, kSupport);
  const auto slope_u = hn::Add(change.slope_u, turned.u);
  const auto slope_v = hn::Add(change.slope_v, turned.v);
  const auto agreed = agreement(value, slope_u, slope_v, estimate);
  const float noise = pixelNoise(fit);
  Estimate to;
  to.value = hn::Add(estimate.value, value);
  to.slope_u = hn::Add(estimate.slope_u, slope_u);
  to.slope_v = hn::Add(estimate.slope_v, slope_v);
  to.bend_uu = to.bend_uv = to.bend_vv = to.bend_sigma = set(0);
  to.sigma = hn::Mul(change.missing, set(noise * kSupport.plane));
  to.slope_sigma = hn::Mul(squared(change.missing), set(noise * kSupport.slope));
  to.value_by_bend = set(kSupport.valueByBend());
  chain = hn::Mul(chain, hn::Mul(flat, agreed));
  approach(estimate, to, chain);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
