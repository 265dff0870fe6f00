// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, after the kernel's includes and before its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_ESTIMATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_ESTIMATE_INL_H_
#undef HAPTICD_RT_FACET_ESTIMATE_INL_H_
#else
#define HAPTICD_RT_FACET_ESTIMATE_INL_H_
#endif

#include "hwy/highway.h"
#include "rt/modelling/surface/facet_fit.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using Floats = hn::Vec<FloatTag>;
using Lanes = hn::Mask<FloatTag>;

HWY_INLINE Floats set(float value) {
  return hn::Set(FloatTag(), value);
}

HWY_INLINE Floats squared(Floats x) {
  return hn::Mul(x, x);
}

HWY_INLINE Floats load(const float* from) {
  return hn::LoadU(FloatTag(), from);
}

HWY_INLINE void store(Floats x, float* to) {
  hn::StoreU(x, FloatTag(), to);
}

/// Returns 1 below `begin`, 0 from `end` on, and a smooth step (3 t^2 - 2 t^3) in between.
HWY_INLINE Floats fallingStep(Floats x, float begin, float end) {
  const auto share = hn::Mul(hn::Sub(x, set(begin)), set(1 / (end - begin)));
  const auto t = hn::Min(hn::Max(share, set(0)), set(1));
  return hn::NegMulAdd(squared(t), hn::NegMulAdd(set(2), t, set(3)), set(1));
}

/// Returns the index of the block `rows` and `columns` further on.
HWY_INLINE std::size_t moved(std::size_t index, int rows, int columns) {
  return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(index) +
                                  rows * static_cast<std::ptrdiff_t>(FacetBlocks::kStride) + columns);
}

/// Returns the lanes of the vector at `site` that are sites with a measurement.
HWY_INLINE Lanes knownSites(const FacetBlocks& blocks, int row, int site) {
  const auto inside = hn::FirstN(FloatTag(), static_cast<std::size_t>(blocks.sites_across - site));
  return hn::And(inside, hn::Ge(load(blocks.disparity + FacetBlocks::at(row, site)), set(0)));
}

/// A square support of (2 n + 1) x (2 n + 1) samples spaced `spacing` blocks apart; each sample is the mean
/// over `box` x `box` blocks. The standard deviations are those of a least-squares fit on the complete
/// square, relative to that of a pixel's noise, which is modelled as white noise smoothed over the sensor's
/// matching window of 9 x 9 pixels.
struct Support {
  int n;
  int spacing;
  int box;
  float sample;     ///< standard deviation of a sample
  float plane;      ///< of the value of a plane
  float quadratic;  ///< of the value of a quadratic
  float slope;      ///< of a slope, per block
  float curvature;  ///< of the coefficients of u^2 and v^2
  float twist;      ///< of the coefficient of u v

  constexpr float side() const { return static_cast<float>(2 * n * spacing + box); }
  constexpr float reach() const { return static_cast<float>(n * spacing); }
  constexpr float samples() const { return static_cast<float>((2 * n + 1) * (2 * n + 1)); }
  /// Means of i^2 and i^4 over i = -n..n.
  constexpr float m2() const { return static_cast<float>(n * (n + 1)) / 3; }
  constexpr float m4() const { return static_cast<float>(n * (n + 1) * (3 * n * n + 3 * n - 1)) / 15; }
  /// Returns the offset of the samples' mean from the value at the site, per unit of curvature.
  constexpr float valueByCurvature() const {
    return m2() * static_cast<float>(spacing * spacing) + static_cast<float>(box * box - 1) / 12;
  }
};
inline constexpr Support kThree{1, 1, 1, 0.861F, 0.565F, 0.819F, 0.452F, 0.376F, 0.361F};
inline constexpr Support kFive{2, 1, 1, 0.861F, 0.383F, 0.652F, 0.221F, 0.141F, 0.128F};
inline constexpr Support kNine{2, 2, 1, 0.861F, 0.217F, 0.410F, 0.0726F, 0.0289F, 0.0243F};
inline constexpr Support kFifteen{2, 3, 3, 0.565F, 0.143F, 0.270F, 0.0318F, 0.00843F, 0.00710F};
inline constexpr Support kTwentyFive{2, 5, 5, 0.383F, 0.0873F, 0.168F, 0.0120F, 0.00196F, 0.00164F};

/// Returns the standard deviation of a pixel's noise, in raw units.
HWY_INLINE float pixelNoise(const FacetFit& fit) {
  return fit.noise_raw / kFive.sample;
}

/// Current estimate of the surface around a vector of sites: a polynomial in blocks relative to each site.
struct Estimate {
  Floats value, slope_u, slope_v;
  Floats curvature_uu, curvature_uv, curvature_vv;
  Floats sigma;  ///< standard deviation of `value`
  Floats slope_sigma;
  Floats curvature_sigma;
  Floats value_by_curvature;  ///< error of `value` on a curved surface, per unit of curvature
};

/// Third-order term of a surface of constant curvature along itself, such as a sphere or cylinder: q(x) (g
/// x), where q is the second-order term. It follows from h_ijk = (h_ij h_kl z_l + h_jk h_il z_l + h_ik h_jl
/// z_l) / (1 + z_l z_l), which states that the second fundamental form is parallel.
struct Cubic {
  Floats u, v;
};

/// Computes the third-order term. `reach`: largest distance in blocks at which q (g x) is used; it is limited
/// because it diverges near the limb.
HWY_INLINE Cubic cubicOf(const Estimate& e, const FacetFit& fit, float reach) {
  constexpr float kMax = 0.43F;
  const auto per_block = set(1 / fit.raw_per_block);  // slopes become tangents
  const auto tan_u = hn::Mul(e.slope_u, per_block);
  const auto tan_v = hn::Mul(e.slope_v, per_block);
  const auto by = hn::Div(per_block, hn::MulAdd(tan_u, tan_u, hn::MulAdd(tan_v, tan_v, set(1))));
  const auto limited = [limit = kMax / reach](Floats x) {
    return hn::Min(hn::Max(x, set(-limit)), set(limit));
  };
  const auto twice_u = hn::Add(tan_u, tan_u);
  const auto twice_v = hn::Add(tan_v, tan_v);
  return {limited(hn::Mul(by, hn::MulAdd(e.curvature_uu, twice_u, hn::Mul(e.curvature_uv, tan_v)))),
          limited(hn::Mul(by, hn::MulAdd(e.curvature_vv, twice_v, hn::Mul(e.curvature_uv, tan_u))))};
}

/// Change of the slopes of a least-squares plane on a square that is caused by the third-order term.
struct Turn {
  Floats u, v;
};
/// `m2`: mean of i^2 over the square's blocks; `m4_by_m2`: mean of i^4 divided by m2.
HWY_INLINE Turn turnBy(const Cubic& g, const Estimate& e, Floats m2, Floats m4_by_m2) {
  const auto across_u = hn::MulAdd(e.curvature_uv, g.v, hn::Mul(e.curvature_vv, g.u));
  const auto across_v = hn::MulAdd(e.curvature_uv, g.u, hn::Mul(e.curvature_uu, g.v));
  return {hn::MulAdd(m4_by_m2, hn::Mul(e.curvature_uu, g.u), hn::Mul(m2, across_u)),
          hn::MulAdd(m4_by_m2, hn::Mul(e.curvature_vv, g.v), hn::Mul(m2, across_v))};
}

/// Computes the change of slope for the samples of a support.
HWY_INLINE Turn turnBy(const Cubic& g, const Estimate& e, const Support& support) {
  const auto square = static_cast<float>(support.spacing * support.spacing);
  return turnBy(g, e, set(support.m2() * square), set(support.m4() / support.m2() * square));
}

/// Returns the sum of squares of the curvature coefficients divided by their variances: chi-square
/// distributed with three degrees of freedom on a flat surface.
HWY_INLINE Floats significanceOf(Floats curvature_uu, Floats curvature_uv, Floats curvature_vv,
                                 const Support& support, const FacetFit& fit) {
  const float curvature = pixelNoise(fit) * support.curvature;
  const float twist = pixelNoise(fit) * support.twist;
  return hn::MulAdd(hn::MulAdd(curvature_uu, curvature_uu, squared(curvature_vv)),
                    set(1 / (curvature * curvature)),
                    hn::Mul(squared(curvature_uv), set(1 / (twist * twist))));
}

/// Values of significanceOf() below which a support is treated as flat and above which it is treated as
/// curved; in between, both are mixed.
struct Flatness {
  float flat_below;
  float curved_above;
};
/// For small supports. Treating a curved surface as flat causes a larger error than the noise of a quadratic,
/// and wide supports determine much better whether a surface is flat.
inline constexpr Flatness kOfSmall{1, 4};
/// For wide supports, where only flat surfaces continue to grow, and for 3 x 3 blocks, which determine
/// curvature poorly. The values are 74 % and 98 % of the chi-square distribution.
inline constexpr Flatness kOfOthers{4, 10};

/// Returns the degree to which a support is treated as flat, 0..1.
HWY_INLINE Floats flatShare(Floats significance, const Flatness& flatness) {
  return fallingStep(significance, flatness.flat_below, flatness.curved_above);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
