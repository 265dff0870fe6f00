// SPDX-License-Identifier: Apache-2.0
#include "rt/depth/depth_model.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "rt/base/pose.h"
#include "rt/depth/disparity_image.h"

namespace hapticd::rt {
namespace {

DepthModel::SingleRay single(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// No camera sees this far; comparisons against it also reject NaN.
constexpr double kOutOfSight_m = 1e6;

constexpr int kMinSide_px = 16;
constexpr std::uint32_t kMaxRawValues = 65536;

struct Interval {
  double first;
  double last;
};

/// Returns the slopes x/Z of the two lines from the origin that are tangent to a circle around (x, depth).
/// The circle must not meet the plane Z = 0.
Interval tangentSlopes(double x, double depth, double radius) {
  const double denominator = depth * depth - radius * radius;
  const double root = radius * std::sqrt(x * x + denominator);
  return {(x * depth - root) / denominator, (x * depth + root) / denominator};
}

/// Converts the interval [first, last] to whole pixels, widened by one pixel for rounding and clipped to
/// 0..count-1.
void clipToImage(double first, double last, int count, int& pixel_first, int& pixel_last) {
  pixel_first = static_cast<int>(std::clamp(std::floor(first) - 1, 0.0, static_cast<double>(count)));
  pixel_last = static_cast<int>(std::clamp(std::ceil(last) + 1, -1.0, static_cast<double>(count - 1)));
}

/// Returns a window without pixels of the raw values between two real ones, widened to whole values and
/// limited to 0..last.
PixelWindow rawsAround(double one, double other, std::uint32_t last) {
  const auto [low, high] = std::minmax(one, other);
  PixelWindow window;
  window.raw_first = static_cast<std::uint16_t>(std::clamp(std::floor(low), 0.0, last + 1.0));
  window.raw_last = static_cast<std::uint16_t>(std::clamp(std::ceil(high), 0.0, static_cast<double>(last)));
  return window;
}

}  // namespace

CameraFault faultOf(const DepthModelParameters& camera) noexcept {
  const auto isFinite = [](std::initializer_list<double> numbers) {
    return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
  };
  if (camera.width_px < kMinSide_px || camera.width_px > kMaxFrameWidth || camera.height_px < kMinSide_px ||
      camera.height_px > kMaxFrameHeight) {
    return CameraFault::size;
  }
  if (!isFinite({camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px}) || !(camera.fx_px > 0) ||
      !(camera.fy_px > 0)) {
    return CameraFault::intrinsics;
  }
  if (!isFinite({camera.near_m, camera.far_m}) || !(camera.near_m > 0) || !(camera.far_m > camera.near_m)) {
    return CameraFault::limits;
  }
  const DepthNoiseParameters& noise = camera.noise;
  if (!isFinite({noise.c0_m, noise.c1, noise.c2_per_m, noise.correlation_px}) || noise.c0_m < 0 ||
      noise.c1 < 0 || noise.c2_per_m < 0 || !(noise.standing_share >= 0 && noise.standing_share <= 1) ||
      noise.correlation_px < 1) {
    return CameraFault::noise;
  }
  const bool has_raws = camera.raw_values >= 2 && camera.raw_values <= kMaxRawValues;
  const bool linear = camera.law == DepthLawKind::linear;
  const bool has_law = linear ? std::isfinite(camera.unit_m) && camera.unit_m > 0
                              : isFinite({camera.a_per_m, camera.b_per_m}) && camera.a_per_m != 0;
  if (!has_raws || !has_law) return CameraFault::depth_law;
  for (std::uint32_t raw = 0; raw < camera.raw_values; ++raw) {
    const double depth =
        linear ? camera.unit_m * raw : 1 / std::max(1e-9, camera.a_per_m * raw + camera.b_per_m);
    if (raw != camera.raw_no_measurement && depth >= camera.near_m && depth <= camera.far_m)
      return CameraFault::none;
  }
  return CameraFault::depth_law;
}

double noiseOfPixel_m(const DepthModelParameters& camera, double depth_m) noexcept {
  if (!camera.noise.isKnown()) return 0;
  const double sigma_m = camera.noise.sigma_m(depth_m);
  return camera.law == DepthLawKind::linear ? std::hypot(sigma_m, camera.unit_m / std::sqrt(12.0)) : sigma_m;
}

double noiseOfMean(int side_px, double correlation_px) noexcept {
  double sum = 0;
  for (int apart = 1 - side_px; apart < side_px; ++apart) {
    const int pairs = side_px - std::abs(apart);
    sum += pairs * std::max(0.0, 1 - std::abs(apart) / correlation_px);
  }
  return sum / (side_px * side_px);  // of the variance along one axis, and so of the deviation along both
}

DepthModel::DepthModel(const DepthModelParameters& parameters, const PoseParameters& T_world_camera)
    : parameters_(parameters),
      rotation_world_camera_(rotationOf(T_world_camera)),
      camera_position_(T_world_camera.position_m),
      table_size_(parameters.law == DepthLawKind::linear ? 0 : parameters.raw_values),
      depth_m_(std::make_unique<double[]>(table_size_)),
      single_depth_m_(std::make_unique<float[]>(table_size_ + kVectorPadding)),
      raw_is_disparity_(parameters.law == DepthLawKind::reciprocal &&
                        parameters.raw_values <= static_cast<std::uint32_t>(kRawDisparities) &&
                        parameters.raw_no_measurement == parameters.raw_values - 1),
      column_rays_(std::make_unique<Ray[]>(static_cast<std::size_t>(parameters.width_px))),
      row_rays_(std::make_unique<Ray[]>(static_cast<std::size_t>(parameters.height_px))) {
  tabulateDepth();
  findValidRaws();
  chooseDisparity();
  tabulateRays();
  computeBounds();
}

void DepthModel::tabulateDepth() {
  if (isLinear()) return;
  for (std::uint32_t raw = 0; raw < parameters_.raw_values; ++raw) {
    const double inverse_depth = parameters_.a_per_m * raw + parameters_.b_per_m;
    const double depth = inverse_depth > 0 ? 1 / inverse_depth : 0;
    const bool valid =
        raw != parameters_.raw_no_measurement && depth >= parameters_.near_m && depth <= parameters_.far_m;
    depth_m_[raw] = valid ? depth : 0;
    single_depth_m_[raw] = static_cast<float>(depth_m_[raw]);
  }
  single_.depth_m = single_depth_m_.get();
}

void DepthModel::findValidRaws() {
  const auto hasDepth = [this](std::uint32_t raw) {
    if (!isLinear()) return depth_m_[raw] > 0;
    const double depth = parameters_.unit_m * raw;
    return raw != parameters_.raw_no_measurement && depth >= parameters_.near_m && depth <= parameters_.far_m;
  };
  bool any = false;
  for (std::uint32_t raw = 0; raw < parameters_.raw_values; ++raw) {
    if (!hasDepth(raw)) continue;
    if (!any) raw_first_ = static_cast<std::uint16_t>(raw);
    raw_last_ = static_cast<std::uint16_t>(raw);
    any = true;
  }
  single_.raw_values = static_cast<std::int32_t>(parameters_.raw_values);
  single_.unit_m = static_cast<float>(parameters_.unit_m);
}

void DepthModel::chooseDisparity() {
  if (raw_is_disparity_) {
    disparity_ = {.a_per_m = parameters_.a_per_m,
                  .b_per_m = parameters_.b_per_m,
                  .last_raw = static_cast<std::uint16_t>(parameters_.raw_no_measurement - 1)};
  } else {
    // Raw disparity 0 is at the near limit and the last one at infinity, which leaves the finest steps.
    constexpr std::uint16_t kLast = kNoRawDisparity - 1;
    disparity_ = {
        .a_per_m = -1 / (kLast * parameters_.near_m), .b_per_m = 1 / parameters_.near_m, .last_raw = kLast};
  }
  const double of_near = disparity_.rawOf(parameters_.near_m);
  const double of_far = disparity_.rawOf(parameters_.far_m);
  const double at_near = noiseScale(parameters_.near_m);
  const double per_raw = (noiseScale(parameters_.far_m) - at_near) / (of_far - of_near);
  noise_bound_ = {.at_zero = at_near - per_raw * of_near, .per_raw = per_raw};
}

std::uint16_t DepthModel::rawOfDisparity(double disparity) const noexcept {
  const double inverse_depth = disparity_.inverseDepth_per_m(disparity);
  if (!(inverse_depth > 0)) return parameters_.raw_no_measurement;
  const double raw = std::round(rawOf(1 / inverse_depth));
  if (!(raw >= raw_first_ && raw <= raw_last_)) return parameters_.raw_no_measurement;
  return static_cast<std::uint16_t>(raw);
}

std::uint16_t DepthModel::disparityOf(std::uint16_t raw) const noexcept {
  const double depth = depth_m(raw);
  if (!(depth > 0)) return kNoRawDisparity;
  return static_cast<std::uint16_t>(
      std::clamp(std::round(disparity_.rawOf(depth)), 0.0, static_cast<double>(disparity_.last_raw)));
}

double DepthModel::noiseScale(double depth_m) const noexcept {
  if (!parameters_.noise.isKnown() || !(depth_m > 0)) return 1;
  // Rounding to whole units, 0.29 raw units, and its steps between neighbours must not exceed the tolerances.
  constexpr double kMin = 0.6;
  return std::max(kMin,
                  noiseOfPixel_m(parameters_, depth_m) / (disparity_.unit_m(depth_m) * kKinectNoise_raw));
}

void DepthModel::tabulateRays() {
  const auto& r = rotation_world_camera_;
  const auto columnRay = [this, &r](double column) {
    const double slope = (column - parameters_.cx_px) / parameters_.fx_px;
    return Ray{slope * r[0], slope * r[3], slope * r[6], 0};
  };
  const auto rowRay = [this, &r](double row) {
    const double slope = -(row - parameters_.cy_px) / parameters_.fy_px;
    return Ray{slope * r[1] - r[2], slope * r[4] - r[5], slope * r[7] - r[8], 0};
  };
  for (int u = 0; u < width_px(); ++u) column_rays_[static_cast<std::size_t>(u)] = columnRay(u);
  for (int v = 0; v < height_px(); ++v) row_rays_[static_cast<std::size_t>(v)] = rowRay(v);
  single_.middle_column = static_cast<float>(width_px() / 2);
  single_.middle_row = static_cast<float>(height_px() / 2);
  const Ray column = columnRay(static_cast<double>(single_.middle_column));
  const Ray row = rowRay(static_cast<double>(single_.middle_row));
  const double column_step = 1 / parameters_.fx_px;
  const double row_step = -1 / parameters_.fy_px;
  single_.middle = single(column.x + row.x, column.y + row.y, column.z + row.z);
  single_.column_step = single(column_step * r[0], column_step * r[3], column_step * r[6]);
  single_.row_step = single(row_step * r[1], row_step * r[4], row_step * r[7]);
}

void DepthModel::computeBounds() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3 low{kInfinity, kInfinity, kInfinity};
  Vec3 high{-kInfinity, -kInfinity, -kInfinity};
  double longest_ray = 0;
  for (const std::size_t u : {std::size_t{0}, static_cast<std::size_t>(width_px() - 1)}) {
    for (const std::size_t v : {std::size_t{0}, static_cast<std::size_t>(height_px() - 1)}) {
      const Vec3 ray{column_rays_[u].x + row_rays_[v].x, column_rays_[u].y + row_rays_[v].y,
                     column_rays_[u].z + row_rays_[v].z};
      longest_ray = std::max(longest_ray, norm(ray));
      for (const double depth : {parameters_.near_m, parameters_.far_m}) {
        const Vec3 p = camera_position_ + depth * ray;
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      }
    }
  }
  bounds_ = {low, high};
  // Rounding of the column's step and ray, of the ray's sum, of the depth, and of the product's sum with the
  // origin: each is at most half a unit in the last place (2^-24 relative) of a number below the farthest
  // point's distance from the camera plus the grid's extent, on three axes. In total that is at most 5 *
  // sqrt(3) * 2^-25 of this number; the voxel index adds the rounding of one more product. The factor below
  // leaves a margin.
  const double farthest = parameters_.far_m * longest_ray + norm(high - low);
  single_precision_error_m_ = 14 * std::ldexp(farthest, -24);
}

PixelWindow DepthModel::withAllPixels(PixelWindow window) const noexcept {
  window.column_first = window.row_first = 0;
  window.column_last = width_px() - 1;
  window.row_last = height_px() - 1;
  return window;
}

PixelWindow DepthModel::wholeFrame() const noexcept {
  return withAllPixels(rawsBetween(parameters_.near_m, parameters_.far_m));
}

PixelWindow DepthModel::wholeDisparity() const noexcept {
  const double of_near = disparity_.rawOf(parameters_.near_m);
  const double of_far = disparity_.rawOf(parameters_.far_m);
  return withAllPixels(rawsAround(of_near, of_far, disparity_.last_raw));
}

PixelWindow DepthModel::rawsBetween(double nearest_m, double farthest_m) const noexcept {
  nearest_m = std::max(nearest_m, parameters_.near_m);
  farthest_m = std::min(farthest_m, parameters_.far_m);
  if (nearest_m > farthest_m) return {.raw_first = 1, .raw_last = 0};
  const bool none_is_last = parameters_.raw_no_measurement == parameters_.raw_values - 1;
  PixelWindow window =
      rawsAround(rawOf(nearest_m), rawOf(farthest_m), parameters_.raw_values - (none_is_last ? 2 : 1));
  if (isLinear()) {
    window.raw_first = std::max(window.raw_first, raw_first_);
    window.raw_last = std::min(window.raw_last, raw_last_);
  }
  return window;
}

PixelWindow DepthModel::windowOfBall(const Vec3& centre_m_in_world, double radius_m) const noexcept {
  if (!(norm(centre_m_in_world - camera_position_) < kOutOfSight_m)) return {};
  const double depth = -positionInCamera(centre_m_in_world).z;
  const PixelWindow raws = rawsBetween(depth - radius_m, depth + radius_m);
  if (raws.raw_first > raws.raw_last) return {};
  PixelWindow window = pixelsOfBall(centre_m_in_world, radius_m);
  window.raw_first = raws.raw_first;
  window.raw_last = raws.raw_last;
  return window;
}

PixelWindow DepthModel::pixelsOfBall(const Vec3& centre_m_in_world, double radius_m) const noexcept {
  if (!(norm(centre_m_in_world - camera_position_) < kOutOfSight_m)) return {};
  const Vec3 centre = positionInCamera(centre_m_in_world);
  const double depth = -centre.z;
  PixelWindow window;
  if (depth <= -radius_m) return window;
  constexpr double kTangentMargin = 1.001;  // closer to the camera plane the tangents diverge
  if (depth <= kTangentMargin * radius_m) {
    return withAllPixels(window);
  }
  const Interval columns = tangentSlopes(centre.x, depth, radius_m);
  const Interval rows = tangentSlopes(centre.y, depth, radius_m);
  clipToImage(parameters_.cx_px + parameters_.fx_px * columns.first,
              parameters_.cx_px + parameters_.fx_px * columns.last, width_px(), window.column_first,
              window.column_last);
  clipToImage(parameters_.cy_px - parameters_.fy_px * rows.last,
              parameters_.cy_px - parameters_.fy_px * rows.first, height_px(), window.row_first,
              window.row_last);
  return window;
}

}  // namespace hapticd::rt
