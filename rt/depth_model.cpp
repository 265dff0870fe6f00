// SPDX-License-Identifier: Apache-2.0
#include "rt/depth_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt/pose.h"

namespace hapticd::rt {
namespace {

DepthModel::SingleRay single(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// No camera sees this far; comparisons against it also reject NaN.
constexpr double kOutOfSight_m = 1e6;

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

}  // namespace

DepthModel::DepthModel(const DepthModelParameters& parameters, const PoseParameters& T_world_camera)
    : parameters_(parameters),
      rotation_world_camera_(rotationOf(T_world_camera)),
      camera_position_(T_world_camera.position_m) {
  tabulateDepth();
  tabulateRays();
  computeBounds();
}

void DepthModel::tabulateDepth() {
  for (int raw = 0; raw < kRawValues; ++raw) {
    const double inverse_depth = parameters_.a_per_m * raw + parameters_.b_per_m;
    const double depth = inverse_depth > 0 ? 1 / inverse_depth : 0;
    const bool valid = raw != kRawNoMeasurement && depth >= parameters_.near_m && depth <= parameters_.far_m;
    const auto index = static_cast<std::size_t>(raw);
    depth_m_[index] = valid ? depth : 0;
    single_.depth_m[index] = static_cast<float>(depth_m_[index]);
  }
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
  for (std::size_t u = 0; u < kFrameWidth; ++u) column_rays_[u] = columnRay(static_cast<double>(u));
  for (std::size_t v = 0; v < kFrameHeight; ++v) row_rays_[v] = rowRay(static_cast<double>(v));
  const Ray column = columnRay(static_cast<double>(kMiddleColumn));
  const Ray row = rowRay(static_cast<double>(kMiddleRow));
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
  for (const std::size_t u : {std::size_t{0}, std::size_t{kFrameWidth - 1}}) {
    for (const std::size_t v : {std::size_t{0}, std::size_t{kFrameHeight - 1}}) {
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

PixelWindow DepthModel::wholeFrame() const noexcept {
  PixelWindow window = rawsBetween(parameters_.near_m, parameters_.far_m);
  window.column_last = kFrameWidth - 1;
  window.row_last = kFrameHeight - 1;
  return window;
}

PixelWindow DepthModel::rawsBetween(double nearest_m, double farthest_m) const noexcept {
  PixelWindow window;
  window.raw_first = kRawNoMeasurement;
  nearest_m = std::max(nearest_m, parameters_.near_m);
  farthest_m = std::min(farthest_m, parameters_.far_m);
  if (nearest_m > farthest_m) return window;
  // raw is a monotonic function of depth, rising or falling with the sign of a
  const double raw_of_nearest = (1 / nearest_m - parameters_.b_per_m) / parameters_.a_per_m;
  const double raw_of_farthest = (1 / farthest_m - parameters_.b_per_m) / parameters_.a_per_m;
  const auto [low, high] = std::minmax(raw_of_nearest, raw_of_farthest);
  window.raw_first = static_cast<std::uint16_t>(std::clamp(std::floor(low), 0.0, kRawNoMeasurement - 0.0));
  window.raw_last = static_cast<std::uint16_t>(std::clamp(std::ceil(high), 0.0, kRawNoMeasurement - 1.0));
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
    window.column_last = kFrameWidth - 1;
    window.row_last = kFrameHeight - 1;
    return window;
  }
  const Interval columns = tangentSlopes(centre.x, depth, radius_m);
  const Interval rows = tangentSlopes(centre.y, depth, radius_m);
  clipToImage(parameters_.cx_px + parameters_.fx_px * columns.first,
              parameters_.cx_px + parameters_.fx_px * columns.last, kFrameWidth, window.column_first,
              window.column_last);
  clipToImage(parameters_.cy_px - parameters_.fy_px * rows.last,
              parameters_.cy_px - parameters_.fy_px * rows.first, kFrameHeight, window.row_first,
              window.row_last);
  return window;
}

}  // namespace hapticd::rt
