// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, from between the kernel's includes and its HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_FACET_ESTIMATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_FACET_ESTIMATE_INL_H_
#undef HAPTICD_RT_FACET_ESTIMATE_INL_H_
#else
#define HAPTICD_RT_FACET_ESTIMATE_INL_H_
#endif

#include "hwy/highway.h"
#include "rt/facet_fit.h"

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

/// 1 below `begin`, 0 from `end` on, and a smooth step between them.
HWY_INLINE Floats fallingStep(Floats x, float begin, float end) {
  const auto share = hn::Mul(hn::Sub(x, set(begin)), set(1 / (end - begin)));
  const auto t = hn::Min(hn::Max(share, set(0)), set(1));
  return hn::NegMulAdd(squared(t), hn::NegMulAdd(set(2), t, set(3)), set(1));
}

HWY_INLINE std::size_t moved(std::size_t index, int rows, int columns) {
  return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(index) +
                                  rows * static_cast<std::ptrdiff_t>(FacetBlocks::kStride) + columns);
}

/// A square support of (2 n + 1) x (2 n + 1) samples that are `spacing` blocks apart; each is the mean over
/// `box` x `box` blocks. The standard deviations are those of least squares on the whole square, by that of a
/// pixel's noise, which is white noise smoothed over the matching window of 9 x 9 pixels.
struct Support {
  int n;
  int spacing;
  int box;
  float sample;     ///< standard deviation of a sample
  float plane;      ///< of a plane's value
  float quadratic;  ///< of a quadratic's value
  float slope;      ///< per block
  float bend;       ///< of what multiplies u^2 and v^2
  float twist;      ///< of what multiplies u v

  constexpr float side() const { return static_cast<float>(2 * n * spacing + box); }
  constexpr float reach() const { return static_cast<float>(n * spacing); }
  constexpr float samples() const { return static_cast<float>((2 * n + 1) * (2 * n + 1)); }
  /// Means of i^2 and i^4 over -n..n.
  constexpr float m2() const { return static_cast<float>(n * (n + 1)) / 3; }
  constexpr float m4() const { return static_cast<float>(n * (n + 1) * (3 * n * n + 3 * n - 1)) / 15; }
  /// What the mean of the samples is off the site, for each unit of a bend.
  constexpr float valueByBend() const {
    return m2() * static_cast<float>(spacing * spacing) + static_cast<float>(box * box - 1) / 12;
  }
};
inline constexpr Support kThree{1, 1, 1, 0.861F, 0.565F, 0.819F, 0.452F, 0.376F, 0.361F};
inline constexpr Support kFive{2, 1, 1, 0.861F, 0.383F, 0.652F, 0.221F, 0.141F, 0.128F};
inline constexpr Support kNine{2, 2, 1, 0.861F, 0.217F, 0.410F, 0.0726F, 0.0289F, 0.0243F};
inline constexpr Support kFifteen{2, 3, 3, 0.565F, 0.143F, 0.270F, 0.0318F, 0.00843F, 0.00710F};
inline constexpr Support kTwentyFive{2, 5, 5, 0.383F, 0.0873F, 0.168F, 0.0120F, 0.00196F, 0.00164F};

/// Standard deviation of a pixel's noise.
HWY_INLINE float pixelNoise(const FacetFit& fit) {
  return fit.noise_raw / kFive.sample;
}

/// The surface around a vector of sites so far: a polynomial in blocks from the site.
struct Estimate {
  Floats value, slope_u, slope_v;
  Floats bend_uu, bend_uv, bend_vv;
  Floats sigma;  ///< standard deviation of `value`
  Floats slope_sigma;
  Floats bend_sigma;
  Floats value_by_bend;  ///< how far `value` is off where the surface is curved, for each unit of the bend
};

/// The third order of a surface whose curvature is the same everywhere along it, as on spheres and cylinders:
/// q(x) (g x), where q is the second order. From h_ijk = (h_ij h_kl z_l + h_jk h_il z_l + h_ik h_jl z_l) /
/// (1 + z_l z_l), which says that the second fundamental form is parallel.
struct Cubic {
  Floats u, v;
};

/// `reach`: where q (g x) is still taken to be the third order, blocks; beyond, the limb is near.
HWY_INLINE Cubic cubicOf(const Estimate& e, const FacetFit& fit, float reach) {
  constexpr float kMost = 0.43F;
  const auto per_block = set(1 / fit.raw_per_block);  // slopes become tangents
  const auto tan_u = hn::Mul(e.slope_u, per_block);
  const auto tan_v = hn::Mul(e.slope_v, per_block);
  const auto by = hn::Div(per_block, hn::MulAdd(tan_u, tan_u, hn::MulAdd(tan_v, tan_v, set(1))));
  const auto limited = [most = kMost / reach](Floats x) {
    return hn::Min(hn::Max(x, set(-most)), set(most));
  };
  const auto twice_u = hn::Add(tan_u, tan_u);
  const auto twice_v = hn::Add(tan_v, tan_v);
  return {limited(hn::Mul(by, hn::MulAdd(e.bend_uu, twice_u, hn::Mul(e.bend_uv, tan_v)))),
          limited(hn::Mul(by, hn::MulAdd(e.bend_vv, twice_v, hn::Mul(e.bend_uv, tan_u))))};
}

/// What the third order adds to slopes by least squares on a square; `m2`: of its blocks, `m4_by_m2`.
struct Turn {
  Floats u, v;
};
HWY_INLINE Turn turnBy(const Cubic& g, const Estimate& e, Floats m2, Floats m4_by_m2) {
  const auto across_u = hn::MulAdd(e.bend_uv, g.v, hn::Mul(e.bend_vv, g.u));
  const auto across_v = hn::MulAdd(e.bend_uv, g.u, hn::Mul(e.bend_uu, g.v));
  return {hn::MulAdd(m4_by_m2, hn::Mul(e.bend_uu, g.u), hn::Mul(m2, across_u)),
          hn::MulAdd(m4_by_m2, hn::Mul(e.bend_vv, g.v), hn::Mul(m2, across_v))};
}

/// The same on a support.
HWY_INLINE Turn turnBy(const Cubic& g, const Estimate& e, const Support& support) {
  const auto square = static_cast<float>(support.spacing * support.spacing);
  return turnBy(g, e, set(support.m2() * square), set(support.m4() / support.m2() * square));
}

/// The bends of a quadratic, squared and by their variances: chi-square of three numbers where it is flat.
HWY_INLINE Floats significanceOf(Floats bend_uu, Floats bend_uv, Floats bend_vv, const Support& support,
                                 const FacetFit& fit) {
  const float bend = pixelNoise(fit) * support.bend;
  const float twist = pixelNoise(fit) * support.twist;
  return hn::MulAdd(hn::MulAdd(bend_uu, bend_uu, squared(bend_vv)), set(1 / (bend * bend)),
                    hn::Mul(squared(bend_uv), set(1 / (twist * twist))));
}

/// Where significanceOf() makes a flat surface of a support, and where a curved one.
struct Flatness {
  float flat_below;
  float curved_above;
};
/// Of small supports: whoever takes a curved surface for a flat one errs by more than the noise of a
/// quadratic, and that a surface is flat is known far better on wide supports.
inline constexpr Flatness kOfSmall{1, 4};
/// Of wide supports, where only what is flat goes on, and of 3 x 3 blocks, where little is known of bends: 74
/// % and 98 % of the chi-square distribution.
inline constexpr Flatness kOfOthers{4, 10};

HWY_INLINE Floats flatShare(Floats significance, const Flatness& flatness) {
  return fallingStep(significance, flatness.flat_below, flatness.curved_above);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
