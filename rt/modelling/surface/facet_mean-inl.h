// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, after the kernel's includes and before its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_MEAN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_MEAN_INL_H_
#undef HAPTICD_RT_FACET_MEAN_INL_H_
#else
#define HAPTICD_RT_FACET_MEAN_INL_H_
#endif

#include <algorithm>

#include "rt/modelling/surface/facet_estimate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// Estimates up to this many blocks away contribute to the mean.
constexpr int kFarthestMean = 2;
constexpr float kUnknown = 1e9F;

HWY_INLINE void storeEstimate(const Estimate& e, Lanes known, const FacetFit& fit, std::size_t index,
                              const FacetMemory::Estimates& out) {
  const Cubic cubic = cubicOf(e, fit, kFarthestMean);
  // Unknown values may be NaN, which a weight of 0 would not remove.
  const auto put = [known, index](Floats x, float* to) { store(hn::IfThenElseZero(known, x), to + index); };
  put(e.value, out.value);
  put(e.slope_u, out.slope_u);
  put(e.slope_v, out.slope_v);
  put(e.curvature_uu, out.curvature_uu);
  put(e.curvature_uv, out.curvature_uv);
  put(e.curvature_vv, out.curvature_vv);
  put(cubic.u, out.cubic_u);
  put(cubic.v, out.cubic_v);
  put(e.curvature_sigma, out.curvature_sigma);
  store(hn::IfThenElse(known, e.slope_sigma, set(1)), out.slope_sigma + index);
  store(hn::IfThenElse(known, e.sigma, set(kUnknown)), out.sigma + index);
}

/// Marks the estimates around the sites as unknown.
inline void clearBorder(const FacetBlocks& blocks, const FacetMemory::Estimates& out) {
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

/// Prediction of a vector of sites by the estimates `du` and `dv` blocks away.
struct Expected {
  Floats value, slope_u, slope_v;
  Floats variance, slope_variance;
};

/// Predicts a vector of sites from the estimates `du` and `dv` blocks away.
HWY_INLINE Expected expectedFrom(const FacetMemory::Estimates& all, std::size_t index, int du, int dv) {
  const auto u = set(static_cast<float>(-du));
  const auto v = set(static_cast<float>(-dv));
  const auto square = static_cast<float>(du * du + dv * dv);
  const auto uu = load(all.curvature_uu + index);
  const auto uv = load(all.curvature_uv + index);
  const auto vv = load(all.curvature_vv + index);
  const auto cubic_u = load(all.cubic_u + index);
  const auto cubic_v = load(all.cubic_v + index);
  const auto slope_u = load(all.slope_u + index);
  const auto slope_v = load(all.slope_v + index);
  const auto turn_u = hn::MulAdd(hn::Add(uu, uu), u, hn::Mul(uv, v));
  const auto turn_v = hn::MulAdd(hn::Add(vv, vv), v, hn::Mul(uv, u));
  const auto curvature = hn::Mul(set(0.5F), hn::MulAdd(turn_u, u, hn::Mul(turn_v, v)));
  const auto third = hn::MulAdd(cubic_u, u, hn::MulAdd(cubic_v, v, set(1)));
  const auto slope_variance = squared(load(all.slope_sigma + index));
  const auto curvature_variance = squared(load(all.curvature_sigma + index));
  const auto of_slopes = hn::MulAdd(set(square), curvature_variance, slope_variance);
  return {.value = hn::MulAdd(slope_u, u,
                              hn::MulAdd(slope_v, v, hn::MulAdd(curvature, third, load(all.value + index)))),
          .slope_u = hn::Add(slope_u, hn::MulAdd(turn_u, third, hn::Mul(curvature, cubic_u))),
          .slope_v = hn::Add(slope_v, hn::MulAdd(turn_v, third, hn::Mul(curvature, cubic_v))),
          .variance = hn::MulAdd(set(square), of_slopes, squared(load(all.sigma + index))),
          .slope_variance = hn::MulAdd(set(4 * square), curvature_variance, slope_variance)};
}

/// The averaged facets of a vector of sites.
struct Facets {
  Floats value, slope_u, slope_v;
  Floats curvature;  ///< sum of the coefficients of u^2 and v^2
};

/// Averages a vector of sites with the predictions of the surrounding estimates that agree with them. Weights
/// follow from the variance of the slopes, because errors of the slope dominate the force error.
HWY_INLINE Facets meanOfEstimates(const FacetMemory::Estimates& all, std::size_t index) {
  const auto own_value = load(all.value + index);
  const auto own_u = load(all.slope_u + index);
  const auto own_v = load(all.slope_v + index);
  const auto own_variance = squared(load(all.sigma + index));
  const auto own_slope_variance = squared(load(all.slope_sigma + index));
  // Weights of neighbours are relative to the site's own. Differences are summed to preserve precision.
  auto total = set(1);
  auto value = set(0);
  auto slope_u = set(0);
  auto slope_v = set(0);
  auto curvature = hn::Add(load(all.curvature_uu + index), load(all.curvature_vv + index));
  for (int dv = -kFarthestMean; dv <= kFarthestMean; ++dv) {
    for (int du = -kFarthestMean; du <= kFarthestMean; ++du) {
      // Every other block suffices, because adjacent estimates share most of their data.
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
      curvature = hn::MulAdd(
          weight, hn::Add(load(all.curvature_uu + neighbour), load(all.curvature_vv + neighbour)), curvature);
    }
  }
  const auto share = hn::Div(set(1), total);
  return {.value = hn::MulAdd(share, value, own_value),
          .slope_u = hn::MulAdd(share, slope_u, own_u),
          .slope_v = hn::MulAdd(share, slope_v, own_v),
          .curvature = hn::Mul(share, curvature)};
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
