// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/resting_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace hapticd::tools {
namespace {

constexpr int kTermsOfQuadratic = 6;
constexpr int kLeastHalf_px = 12;
constexpr double kLeastRestingShare = 0.97;
constexpr double kMostOutliers = 0.01;
constexpr double kMostResidual_raw = 0.8;  // the static pattern of a Kinect is 0.24 to 0.56
// A surface that bends more within its size is no longer flat for a patch of 40 mm.
constexpr double kLeastRadius_m = 0.3;

/// A square of pixels around a middle.
struct Square {
  int column;
  int row;
  int half_px;

  bool overlaps(const Square& other) const {
    const int reach = half_px + other.half_px;
    return std::abs(column - other.column) < reach && std::abs(row - other.row) < reach;
  }
};

/// Sums over rectangles of the image of whether pixels rest.
class RestingCount {
 public:
  RestingCount(std::span<const PixelStatistics> pixels, std::size_t frames, const CameraDisparity& camera)
      : row_length_(static_cast<std::size_t>(camera.width_px()) + 1),
        sums_(row_length_ * (static_cast<std::size_t>(camera.height_px()) + 1)) {
    for (int row = 0; row < camera.height_px(); ++row) {
      for (int column = 0; column < camera.width_px(); ++column) {
        at(column + 1, row + 1) = at(column, row + 1) + at(column + 1, row) - at(column, row) +
                                  (rests(pixels[camera.pixelOf(column, row)], frames) ? 1 : 0);
      }
    }
  }
  double share(const Square& square) {
    const int left = square.column - square.half_px;
    const int top = square.row - square.half_px;
    const int right = square.column + square.half_px + 1;
    const int bottom = square.row + square.half_px + 1;
    const int resting = at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
    return static_cast<double>(resting) / ((right - left) * (bottom - top));
  }

 private:
  int& at(int column, int row) {
    return sums_[static_cast<std::size_t>(row) * row_length_ + static_cast<std::size_t>(column)];
  }
  std::size_t row_length_;
  std::vector<int> sums_;
};

/// The largest curvature of the fitted surface along row and column at its middle, 1/m.
double curvatureOf(const CameraDisparity& camera, const RestingSurface& surface) {
  const auto bend = [&](double across_column, double across_row) {
    const double reach = 0.5 * surface.half_px;
    const SurfacePoint before = surfacePoint(camera, surface.fit, surface.column - reach * across_column,
                                             surface.row - reach * across_row);
    const SurfacePoint after = surfacePoint(camera, surface.fit, surface.column + reach * across_column,
                                            surface.row + reach * across_row);
    return norm(after.normal - before.normal) / norm(after.position_m - before.position_m);
  };
  return std::max(bend(1, 0), bend(0, 1));
}

std::vector<DisparitySample> samplesOf(std::span<const PixelStatistics> pixels, std::size_t frames,
                                       const CameraDisparity& camera, const Square& square, int step) {
  std::vector<DisparitySample> samples;
  for (int row = square.row - square.half_px; row <= square.row + square.half_px; row += step) {
    for (int column = square.column - square.half_px; column <= square.column + square.half_px;
         column += step) {
      const PixelStatistics& pixel = pixels[camera.pixelOf(column, row)];
      if (rests(pixel, frames))
        samples.push_back({static_cast<double>(column), static_cast<double>(row), pixel.mean});
    }
  }
  return samples;
}

std::optional<RestingSurface> surfaceIn(const Square& square, std::span<const PixelStatistics> pixels,
                                        std::size_t frames, const CameraDisparity& camera) {
  const int step = std::max(1, square.half_px / 16);
  const auto fit = fitDisparity(samplesOf(pixels, frames, camera, square, step), square.column, square.row,
                                square.half_px);
  if (!fit || fit->outlier_share > kMostOutliers) return std::nullopt;
  const double noise_scale = camera.noiseScale(fit->quadratic.at(square.column, square.row));
  if (fit->residual_raw > kMostResidual_raw * noise_scale) return std::nullopt;
  RestingSurface surface{.fit = fit->quadratic,
                         .column = static_cast<double>(square.column),
                         .row = static_cast<double>(square.row),
                         .half_px = square.half_px,
                         .residual_raw = fit->residual_raw};
  const SurfacePoint middle = surfacePoint(camera, surface.fit, surface.column, surface.row);
  surface.distance_m = -middle.position_m.z;
  if (curvatureOf(camera, surface) > 1 / kLeastRadius_m) return std::nullopt;
  const double side_px = 2 * square.half_px + 1;
  // samples that are farther apart than errors are alike are independent
  const double alike_px = std::max(camera.correlation_px(), static_cast<double>(step));
  const double error_raw = fitError(fit->residual_raw, side_px * side_px, kTermsOfQuadratic, alike_px);
  surface.fit_error_m = error_raw * camera.unit_m(surface.distance_m) * middle.normal.z;
  return surface;
}

/// The square of `size_m` around a pixel, if it is in the image.
std::optional<Square> squareAround(int column, int row, double size_m, double distance_m,
                                   const CameraDisparity& camera) {
  const Square square{
      column, row,
      static_cast<int>(std::lround(size_m * camera.model().parameters().fx_px / distance_m / 2))};
  const bool inside = column - square.half_px >= 0 && row - square.half_px >= 0 &&
                      column + square.half_px < camera.width_px() &&
                      row + square.half_px < camera.height_px();
  if (!inside || square.half_px < kLeastHalf_px) return std::nullopt;
  return square;
}

/// Returns all candidates of one size.
std::vector<RestingSurface> candidates(std::span<const PixelStatistics> pixels, std::size_t frames,
                                       RestingCount& resting, const CameraDisparity& camera, double size_m) {
  constexpr int kStride_px = 8;
  const rt::DepthModelParameters& limits = camera.model().parameters();
  std::vector<RestingSurface> found;
  for (int row = 0; row < camera.height_px(); row += kStride_px) {
    for (int column = 0; column < camera.width_px(); column += kStride_px) {
      const PixelStatistics& middle = pixels[camera.pixelOf(column, row)];
      const double distance_m = camera.depth_m(double{middle.mean});
      if (!rests(middle, frames) || distance_m < limits.near_m || distance_m >= limits.far_m) continue;
      const auto square = squareAround(column, row, size_m, distance_m, camera);
      if (!square || resting.share(*square) < kLeastRestingShare) continue;
      if (auto surface = surfaceIn(*square, pixels, frames, camera)) {
        surface->size_m = size_m;
        found.push_back(*surface);
      }
    }
  }
  return found;
}

}  // namespace

std::size_t distanceClassOf(double distance_m, std::span<const double> borders_m) {
  const auto above = std::ranges::upper_bound(borders_m, distance_m);
  return static_cast<std::size_t>(above - borders_m.begin());
}

double fitError(double residual_raw, double pixels, int terms, double correlation_px) {
  // The covariance of noise that is smoothed by a square adds up to the variance times the square's area.
  const double samples = pixels / (correlation_px * correlation_px);
  // A fit takes some of the pattern for the surface, so that less of it is left about it.
  const double share_left = std::max(1 - terms / samples, 0.1);
  return residual_raw / std::sqrt(share_left) * std::sqrt(terms / samples);
}

std::vector<RestingSurface> restingSurfaces(std::span<const PixelStatistics> pixels, std::size_t frames,
                                            const CameraDisparity& camera,
                                            const RestingSurfaceOptions& options) {
  RestingCount resting(pixels, frames, camera);
  std::vector<RestingSurface> chosen;
  for (const double size_m : options.sizes_m) {
    std::vector<RestingSurface> found = candidates(pixels, frames, resting, camera, size_m);
    std::ranges::stable_sort(found, {}, &RestingSurface::residual_raw);
    std::vector<int> of_class(options.class_borders_m.size() + 1, 0);
    std::vector<Square> taken;
    for (const RestingSurface& surface : found) {
      int& count = of_class[distanceClassOf(surface.distance_m, options.class_borders_m)];
      const Square square{static_cast<int>(surface.column), static_cast<int>(surface.row), surface.half_px};
      const bool overlaps =
          std::ranges::any_of(taken, [&square](const Square& other) { return square.overlaps(other); });
      if (count >= options.most_per_class || overlaps) continue;
      ++count;
      taken.push_back(square);
      chosen.push_back(surface);
    }
  }
  return chosen;
}

}  // namespace hapticd::tools
