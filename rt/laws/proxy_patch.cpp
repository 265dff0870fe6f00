// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/proxy_patch.h"

#include <algorithm>
#include <cmath>

#include "rt/scene/plane_fit_kernel.h"

namespace hapticd::rt {
namespace {

constexpr double kSmallRadius_px = 5;
constexpr double kLargeRadius_px = 20;  // more than four times the 9 px over which noise is correlated
constexpr double kMinLarge_m = 0.016;
/// Noise including rounding on a surface at rest, measured with real cameras.
constexpr double kNoise_raw = 0.6;
constexpr double kMinNoise_m = 1e-4;
/// A large patch counts as flat up to kFlat variances of the noise and as not flat from kNotFlat on.
constexpr double kFlat = 2.2;
constexpr double kNotFlat = 4.5;
/// Sum of weights (each at most 1) below which points do not determine a surface.
constexpr double kMinWeight = 2;
/// If the fitted slope relative to the assumed normal is steeper, the next look uses a smaller patch.
constexpr double kMaxSlope = 1.5;
/// The proxy does not fall into holes narrower than twice this.
constexpr double kHole_m = 0.011;

struct Frame {
  Vec3 x, y, normal;

  explicit Frame(const Vec3& n) noexcept : normal(n) {
    const Vec3 least = std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 across = least - dot(least, n) * n;
    x = (1 / norm(across)) * across;
    y = cross(n, x);
  }
};

/// A plane h = height + slope_x x + slope_y y and the residuals of its points.
struct Fit {
  double height_m = 0;
  double slope_x = 0;
  double slope_y = 0;
  double residual_m2 = 0;
  double mean_x_m = 0;
  double mean_y_m = 0;
};

/// Fits a plane by least squares. `blur_m`: spread of the points below which they do not determine the slope;
/// the slope is then drawn towards the assumed normal, which the next look replaces by the result of this
/// one.
Fit fitOf(const PlaneSums& s, double blur_m) noexcept {
  Fit fit;
  const double per_w = 1 / s.w;
  fit.mean_x_m = per_w * s.x;
  fit.mean_y_m = per_w * s.y;
  const double mean_h = per_w * s.h;
  const double xx = per_w * s.xx - fit.mean_x_m * fit.mean_x_m + blur_m * blur_m;
  const double yy = per_w * s.yy - fit.mean_y_m * fit.mean_y_m + blur_m * blur_m;
  const double xy = per_w * s.xy - fit.mean_x_m * fit.mean_y_m;
  const double xh = per_w * s.xh - fit.mean_x_m * mean_h;
  const double yh = per_w * s.yh - fit.mean_y_m * mean_h;
  const double determinant = xx * yy - xy * xy;  // positive, because of the blur
  fit.slope_x = (xh * yy - yh * xy) / determinant;
  fit.slope_y = (yh * xx - xh * xy) / determinant;
  const double slope = std::hypot(fit.slope_x, fit.slope_y);
  if (slope > kMaxSlope) {
    fit.slope_x *= kMaxSlope / slope;
    fit.slope_y *= kMaxSlope / slope;
  }
  fit.height_m = mean_h - fit.slope_x * fit.mean_x_m - fit.slope_y * fit.mean_y_m;
  fit.residual_m2 = std::max(0.0, per_w * s.hh - mean_h * mean_h - fit.slope_x * xh - fit.slope_y * yh);
  return fit;
}

Fit mixOf(const Fit& a, const Fit& b, double share_of_a) noexcept {
  const auto mix = [share_of_a](double of_a, double of_b) {
    return share_of_a * of_a + (1 - share_of_a) * of_b;
  };
  return {mix(a.height_m, b.height_m), mix(a.slope_x, b.slope_x),  mix(a.slope_y, b.slope_y), 0,
          mix(a.mean_x_m, b.mean_x_m), mix(a.mean_y_m, b.mean_y_m)};
}

/// Returns the large patch where it is flat up to noise, otherwise the small one.
Fit choose(const PlanePoints& points, const PatchSizes& sizes) noexcept {
  const double blur_m = sizes.pitch_m;
  if (points.small.w < kMinWeight) return fitOf(points.large, blur_m);
  const Fit small = fitOf(points.small, blur_m);
  const Fit large = fitOf(points.large, blur_m);
  const double variances = large.residual_m2 / (sizes.noise_m * sizes.noise_m);
  return mixOf(large, small, std::clamp((kNotFlat - variances) / (kNotFlat - kFlat), 0.0, 1.0));
}

}  // namespace

PatchSizes PatchSizes::at(const DepthModel& model, double depth_m, double min_radius_m,
                          double max_radius_m) noexcept {
  const DepthModelParameters& camera = model.parameters();
  PatchSizes sizes;
  sizes.pitch_m = depth_m / std::min(camera.fx_px, camera.fy_px);
  sizes.noise_m = std::max(kMinNoise_m, kNoise_raw * model.noiseUnit_m(depth_m));
  sizes.small_radius_m = std::min(max_radius_m, std::max(min_radius_m, kSmallRadius_px * sizes.pitch_m));
  sizes.large_radius_m = std::max(
      sizes.small_radius_m, std::min(max_radius_m, std::max(kLargeRadius_px * sizes.pitch_m, kMinLarge_m)));
  return sizes;
}

Patch patchAt(const Scene& scene, const Vec3& place_m_in_world, const Vec3& side_in_world,
              const PatchSizes& sizes, double band_m) HAPTICD_RT {
  const Vec3 local = place_m_in_world - scene.origin_m_in_world;
  const Vec3 from_camera = place_m_in_world - scene.depth_model->cameraPosition_m_in_world();
  const Vec3 sight = (1 / std::max(norm(from_camera), 1e-9)) * from_camera;
  const Frame frame(side_in_world);
  const LocalBall ball{static_cast<float>(local.x), static_cast<float>(local.y), static_cast<float>(local.z),
                       static_cast<float>(sizes.large_radius_m)};
  const PlanePoints points = sumForPlane(scene, {ball, frame.x, frame.y, frame.normal, sight,
                                                 sizes.small_radius_m, band_m, sizes.large_radius_m, band_m});
  Patch patch{.points = points.points, .nearest_m = points.nearest_m, .normal = {}};
  patch.exists = points.large.w >= kMinWeight;
  if (!patch.exists) return patch;
  const Fit fit = choose(points, sizes);
  const double scale = 1 / std::sqrt(1 + fit.slope_x * fit.slope_x + fit.slope_y * fit.slope_y);
  patch.normal = scale * (frame.normal - fit.slope_x * frame.x - fit.slope_y * frame.y);
  patch.height_m = -scale * fit.height_m;
  const double away = dot(patch.normal, sight);
  if (away > 0) {  // no camera sees a surface from behind
    const Vec3 across = patch.normal - away * sight;
    patch.normal = (1 / norm(across)) * across;
  }
  patch.supported = points.nearest_beside_m <= sizes.pitch_m;
  if (patch.supported) return patch;
  const double offset_m = std::hypot(fit.mean_x_m, fit.mean_y_m);
  if (offset_m < sizes.pitch_m) {
    patch.supported = true;  // in the middle of a hole
    return patch;
  }
  const Vec3 outward = (-1 / offset_m) * (fit.mean_x_m * frame.x + fit.mean_y_m * frame.y);
  const LocalBall hole{ball.x_m, ball.y_m, ball.z_m,
                       static_cast<float>(std::min(2 * kHole_m, sizes.large_radius_m))};
  patch.supported =
      points.nearest_m < kHole_m && reachOfPoints_m(scene, hole, patch.normal, band_m, outward) > 0;
  return patch;
}

}  // namespace hapticd::rt
