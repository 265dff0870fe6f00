// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, from between the kernel's includes and its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_MEAN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_MEAN_INL_H_
#undef HAPTICD_RT_FACET_MEAN_INL_H_
#else
#define HAPTICD_RT_FACET_MEAN_INL_H_
#endif

#include <algorithm>

#include "rt/facet_estimate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// Estimates up to that many blocks away say what they expect of a site.
constexpr int kFarthestMean = 2;
constexpr float kUnknown = 1e9F;

HWY_INLINE void storeEstimate(const Estimate& e, Lanes known, const FacetFit& fit, std::size_t index,
                              const FacetMemory::Estimates& out) {
  const Cubic cubic = cubicOf(e, fit, kFarthestMean);
  // What is unknown may be no number, which a weight of 0 would not remove.
  const auto put = [known, index](Floats x, float* to) { store(hn::IfThenElseZero(known, x), to + index); };
  put(e.value, out.value);
  put(e.slope_u, out.slope_u);
  put(e.slope_v, out.slope_v);
  put(e.bend_uu, out.bend_uu);
  put(e.bend_uv, out.bend_uv);
  put(e.bend_vv, out.bend_vv);
  put(cubic.u, out.cubic_u);
  put(cubic.v, out.cubic_v);
  put(e.bend_sigma, out.bend_sigma);
  store(hn::IfThenElse(known, e.slope_sigma, set(1)), out.slope_sigma + index);
  store(hn::IfThenElse(known, e.sigma, set(kUnknown)), out.sigma + index);
}

/// Nothing is known beside the sites.
inline void forgetAround(const FacetBlocks& blocks, const FacetMemory::Estimates& out) {
  for (int row = -kFarthestMean; row < blocks.sites_down + kFarthestMean; ++row) {
    float* const sigma = out.sigma + FacetBlocks::at(row, 0);
    const bool beside = row < 0 || row >= blocks.sites_down;
    if (beside) {
      std::fill_n(sigma - kFarthestMean, blocks.sites_across + 2 * kFarthestMean, kUnknown);
    } else {
      std::fill_n(sigma - kFarthestMean, kFarthestMean, kUnknown);
      std::fill_n(sigma + blocks.sites_across, kFarthestMean, kUnknown);
    }
  }
}

/// What an estimate, `du` and `dv` blocks away, expects of a vector of sites.
struct Expected {
  Floats value, slope_u, slope_v;
  Floats variance, slope_variance;
};

HWY_INLINE Expected expectedFrom(const FacetMemory::Estimates& all, std::size_t index, int du, int dv) {
  const auto u = set(static_cast<float>(-du));
  const auto v = set(static_cast<float>(-dv));
  const auto square = static_cast<float>(du * du + dv * dv);
  const auto uu = load(all.bend_uu + index);
  const auto uv = load(all.bend_uv + index);
  const auto vv = load(all.bend_vv + index);
  const auto cubic_u = load(all.cubic_u + index);
  const auto cubic_v = load(all.cubic_v + index);
  const auto slope_u = load(all.slope_u + index);
  const auto slope_v = load(all.slope_v + index);
  const auto turn_u = hn::MulAdd(hn::Add(uu, uu), u, hn::Mul(uv, v));
  const auto turn_v = hn::MulAdd(hn::Add(vv, vv), v, hn::Mul(uv, u));
  const auto bend = hn::Mul(set(0.5F), hn::MulAdd(turn_u, u, hn::Mul(turn_v, v)));
  const auto third = hn::MulAdd(cubic_u, u, hn::MulAdd(cubic_v, v, set(1)));
  const auto slope_variance = squared(load(all.slope_sigma + index));
  const auto bend_variance = squared(load(all.bend_sigma + index));
  const auto of_slopes = hn::MulAdd(set(square), bend_variance, slope_variance);
  return {.value = hn::MulAdd(slope_u, u,
                              hn::MulAdd(slope_v, v, hn::MulAdd(bend, third, load(all.value + index)))),
          .slope_u = hn::Add(slope_u, hn::MulAdd(turn_u, third, hn::Mul(bend, cubic_u))),
          .slope_v = hn::Add(slope_v, hn::MulAdd(turn_v, third, hn::Mul(bend, cubic_v))),
          .variance = hn::MulAdd(set(square), of_slopes, squared(load(all.sigma + index))),
          .slope_variance = hn::MulAdd(set(4 * square), bend_variance, slope_variance)};
}

/// A facet as it is handed on.
struct Facets {
  Floats value, slope_u, slope_v;
  Floats bend;  ///< of u^2 and v^2 together
};

/// The mean of what the estimates around a vector of sites and their own expect, as far as they agree with
/// their own: weighted by the variance of the slopes, whose errors are what is felt.
HWY_INLINE Facets meanOfEstimates(const FacetMemory::Estimates& all, std::size_t index) {
  const auto own_value = load(all.value + index);
  const auto own_u = load(all.slope_u + index);
  const auto own_v = load(all.slope_v + index);
  const auto own_variance = squared(load(all.sigma + index));
  const auto own_slope_variance = squared(load(all.slope_sigma + index));
  // Neighbours' weights are relative to the own one. Sums are of differences, so that nothing is lost.
  auto total = set(1);
  auto value = set(0);
  auto slope_u = set(0);
  auto slope_v = set(0);
  auto bend = hn::Add(load(all.bend_uu + index), load(all.bend_vv + index));
  for (int dv = -kFarthestMean; dv <= kFarthestMean; ++dv) {
    for (int du = -kFarthestMean; du <= kFarthestMean; ++du) {
      // Every other one is enough: next to each other they know the same.
      if (((du + dv) & 1) != 0 || (du == 0 && dv == 0)) continue;
      const std::size_t neighbour = moved(index, dv, du);
      const Expected e = expectedFrom(all, neighbour, du, dv);
      const auto off = hn::Sub(e.value, own_value);
      const auto off_u = hn::Sub(e.slope_u, own_u);
      const auto off_v = hn::Sub(e.slope_v, own_v);
      const auto off_slope = hn::MulAdd(off_u, off_u, squared(off_v));
      const auto chi_square = hn::Add(hn::Div(squared(off), hn::Add(own_variance, e.variance)),
                                      hn::Div(off_slope, hn::Add(own_slope_variance, e.slope_variance)));
      const auto agreed = fallingStep(chi_square, 4, 12);
      const auto known = hn::Lt(load(all.sigma + neighbour), set(0.5F * kUnknown));
      const auto weight =
          hn::IfThenElseZero(known, hn::Mul(agreed, hn::Div(own_slope_variance, e.slope_variance)));
      total = hn::Add(total, weight);
      value = hn::MulAdd(weight, off, value);
      slope_u = hn::MulAdd(weight, off_u, slope_u);
      slope_v = hn::MulAdd(weight, off_v, slope_v);
      bend = hn::MulAdd(weight, hn::Add(load(all.bend_uu + neighbour), load(all.bend_vv + neighbour)), bend);
    }
  }
  const auto share = hn::Div(set(1), total);
  return {.value = hn::MulAdd(share, value, own_value),
          .slope_u = hn::MulAdd(share, slope_u, own_u),
          .slope_v = hn::MulAdd(share, slope_v, own_v),
          .bend = hn::Mul(share, bend)};
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
