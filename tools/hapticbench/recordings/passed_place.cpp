// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/passed_place.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "drivers/camera/kinect_image.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr float kSameSurface_raw = 2.5F;  // noise, flicker and rounding stay within that
constexpr double kCoverBefore_m = 0.06;   // what is nearer than the background by more is another body
constexpr double kNearest_m = 0.45;
constexpr double kFarthest_m = 3.5;
constexpr int kBorder_px = 24;

std::size_t placeOf(int column, int row) {
  return static_cast<std::size_t>(row) * drivers::kKinectWidth + static_cast<std::size_t>(column);
}

double depthOf(const rt::DepthModelParameters& camera, double raw) {
  return 1 / (camera.a_per_m * raw + camera.b_per_m);
}

/// Raw value of what is `before_m` nearer than `raw`.
double nearerRaw(const rt::DepthModelParameters& camera, double raw, double before_m) {
  return (1 / (depthOf(camera, raw) - before_m) - camera.b_per_m) / camera.a_per_m;
}

/// Content of a frame in the square around a position.
struct SquareContent {
  int pixels = 0;
  int nearer = 0;  ///< than the surface, by so much that it is another body
  int unmeasured = 0;

  bool covered() const { return nearer > 0 || 2 * unmeasured > pixels; }
  /// Whether something passed: more pixels are nearer than the flying pixels of an edge.
  bool passed() const { return 10 * nearer >= pixels; }
};
SquareContent contentOf(const rt::DepthFrame& frame, const PassedPlace& place, double nearest_raw) {
  SquareContent content;
  const auto middle_column = static_cast<int>(place.column);
  const auto middle_row = static_cast<int>(place.row);
  for (int row = middle_row - place.half_px; row <= middle_row + place.half_px; ++row) {
    for (int column = middle_column - place.half_px; column <= middle_column + place.half_px; ++column) {
      const std::uint16_t raw = frame.raw[placeOf(column, row)];
      ++content.pixels;
      if (raw >= drivers::kKinectNoMeasurement) {
        ++content.unmeasured;
      } else if (raw < nearest_raw) {
        ++content.nearer;
      }
    }
  }
  return content;
}

std::optional<PassedPlace> placeAt(int column, int row, const BenchSequence& session,
                                   std::span<const float> background,
                                   const rt::DepthModelParameters& camera) {
  constexpr double kPatch_m = 0.04;
  constexpr double kFitted_m = 0.12;
  constexpr int kLeastHalf_px = 8;
  constexpr double kMostResidual_raw = 1;
  constexpr int kLeastFramesInSight = 15;
  constexpr int kLeastFramesPassed = 2;
  const float raw = background[placeOf(column, row)];
  if (!std::isfinite(raw)) return std::nullopt;
  const double depth = depthOf(camera, raw);
  if (depth < kNearest_m || depth > kFarthest_m) return std::nullopt;
  const int fitted_px =
      std::max(kLeastHalf_px, static_cast<int>(std::lround(kFitted_m / 2 * camera.fx_px / depth)));
  const bool inside = column >= kBorder_px + fitted_px &&
                      column < drivers::kKinectWidth - kBorder_px - fitted_px &&
                      row >= kBorder_px + fitted_px && row < drivers::kKinectHeight - kBorder_px - fitted_px;
  if (!inside) return std::nullopt;
  std::vector<DisparitySample> samples;
  int pixels = 0;
  for (int v = row - fitted_px; v <= row + fitted_px; v += 2) {
    for (int u = column - fitted_px; u <= column + fitted_px; u += 2) {
      ++pixels;
      const float at = background[placeOf(u, v)];
      if (std::isfinite(at)) samples.push_back({static_cast<double>(u), static_cast<double>(v), double{at}});
    }
  }
  if (10 * samples.size() < 9 * static_cast<std::size_t>(pixels)) return std::nullopt;
  const auto fit = fitDisparity(samples, column, row, fitted_px);
  if (!fit || fit->residual_raw > kMostResidual_raw || fit->outlier_share > 0.02) return std::nullopt;
  PassedPlace place{.surface = fit->quadratic,
                    .column = static_cast<double>(column),
                    .row = static_cast<double>(row),
                    .point = surfacePoint(camera, fit->quadratic, column, row),
                    .covered = {}};
  place.distance_m = -place.point.position_m.z;
  place.half_px = std::max(2, static_cast<int>(std::lround(kPatch_m / 2 * camera.fx_px / depth)));
  const double nearest_raw = nearerRaw(camera, fit->quadratic.at(column, row), kCoverBefore_m);
  int passed = 0;
  for (const auto& frame : session.frames) {
    const SquareContent content = contentOf(*frame, place, nearest_raw);
    place.covered.push_back(content.covered());
    if (content.passed()) ++passed;
  }
  if (passed < kLeastFramesPassed || longestInSight(place.covered).frames < kLeastFramesInSight)
    return std::nullopt;
  return place;
}

}  // namespace

InSight longestInSight(const std::vector<bool>& covered) {
  InSight longest;
  int run = 0;
  for (int frame = 0; frame < static_cast<int>(covered.size()); ++frame) {
    run = covered[static_cast<std::size_t>(frame)] ? 0 : run + 1;
    if (run > longest.frames) longest = {frame + 1 - run, run};
  }
  return longest;
}

std::vector<float> restingBackground(const BenchSequence& session, std::span<const PixelStatistics> pixels) {
  std::vector<float> background(drivers::kKinectPixels, std::numeric_limits<float>::quiet_NaN());
  const std::size_t frames = session.frames.size();
  for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
    const float farthest = pixels[pixel].farthest;
    float sum = 0;
    std::size_t count = 0;
    for (const auto& frame : session.frames) {
      const float raw = frame->raw[pixel];
      if (raw >= drivers::kKinectNoMeasurement || std::abs(raw - farthest) > kSameSurface_raw) continue;
      sum += raw;
      ++count;
    }
    if (pixels[pixel].valid > 0 && 10 * count >= 3 * frames)
      background[pixel] = sum / static_cast<float>(count);
  }
  return background;
}

std::vector<PassedPlace> passedPlaces(const BenchSequence& session, std::span<const float> background,
                                      const rt::DepthModelParameters& camera, int most) {
  constexpr int kStride_px = 12;
  std::vector<PassedPlace> candidates;
  for (int row = 0; row < drivers::kKinectHeight; row += kStride_px) {
    for (int column = 0; column < drivers::kKinectWidth; column += kStride_px) {
      if (auto place = placeAt(column, row, session, background, camera))
        candidates.push_back(std::move(*place));
    }
  }
  // each next one is the one that is farthest from those before
  std::vector<PassedPlace> chosen;
  while (!candidates.empty() && static_cast<int>(chosen.size()) < most) {
    const auto apart = [&chosen](const PassedPlace& candidate) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const PassedPlace& other : chosen)
        nearest = std::min(nearest, std::hypot(candidate.column - other.column, candidate.row - other.row));
      return nearest;
    };
    const auto next = std::ranges::max_element(candidates, {}, apart);
    chosen.push_back(std::move(*next));
    candidates.erase(next);
  }
  return chosen;
}

bool measuresNear(const rt::DepthFrame& frame, const rt::DepthModelParameters& camera,
                  const PassedPlace& place, const Vec3& centre_m, double radius_m, double before_m) {
  const double depth = -centre_m.z;
  const auto reach = static_cast<int>(std::ceil(radius_m * camera.fx_px / (depth - radius_m))) + 1;
  const auto middle_column = static_cast<int>(std::lround(camera.cx_px + camera.fx_px * centre_m.x / depth));
  const auto middle_row = static_cast<int>(std::lround(camera.cy_px - camera.fy_px * centre_m.y / depth));
  for (int row = std::max(0, middle_row - reach);
       row <= std::min(drivers::kKinectHeight - 1, middle_row + reach); ++row) {
    for (int column = std::max(0, middle_column - reach);
         column <= std::min(drivers::kKinectWidth - 1, middle_column + reach); ++column) {
      const std::uint16_t raw = frame.raw[placeOf(column, row)];
      if (raw >= drivers::kKinectNoMeasurement) continue;
      const Vec3 point = pointOf(camera, column, row, raw);
      const bool is_before = dot(point - place.point.position_m, place.point.normal) > before_m;
      if (is_before && norm(point - centre_m) <= radius_m) return true;
    }
  }
  return false;
}

}  // namespace hapticd::tools
