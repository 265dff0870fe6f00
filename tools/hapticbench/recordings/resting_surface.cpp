// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/resting_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "drivers/camera/kinect_image.h"
#include "rt/depth_frame.h"

namespace hapticd::tools {
namespace {

constexpr int kTermsOfQuadratic = 6;
constexpr int kLeastHalf_px = 12;
constexpr double kLeastRestingShare = 0.97;
constexpr double kMostOutliers = 0.01;
constexpr double kMostResidual_raw = 0.8;  // the static pattern is 0.24 to 0.56
// A surface that bends more within its size is no longer flat for a patch of 40 mm.
constexpr double kLeastRadius_m = 0.3;

const PixelStatistics& pixelAt(std::span<const PixelStatistics> pixels, int column, int row) {
  return pixels[static_cast<std::size_t>(row) * drivers::kKinectWidth + static_cast<std::size_t>(column)];
}

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

/// Raw units to metres along the optical axis.
double metresPerRaw(const rt::DepthModelParameters& camera, double distance_m) {
  return std::abs(camera.a_per_m) * distance_m * distance_m;
}

/// Sums over rectangles of the image of whether pixels rest.
class RestingCount {
 public:
  RestingCount(std::span<const PixelStatistics> pixels, std::size_t frames)
      : sums_((drivers::kKinectWidth + 1) * (drivers::kKinectHeight + 1)) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        at(column + 1, row + 1) = at(column, row + 1) + at(column + 1, row) - at(column, row) +
                                  (rests(pixelAt(pixels, column, row), frames) ? 1 : 0);
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
    return sums_[static_cast<std::size_t>(row) * (drivers::kKinectWidth + 1) +
                 static_cast<std::size_t>(column)];
  }
  std::vector<int> sums_;
};

/// The largest curvature of the fitted surface along row and column at its middle, 1/m.
double curvatureOf(const rt::DepthModelParameters& camera, const RestingSurface& surface) {
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
                                       const Square& square, int step) {
  std::vector<DisparitySample> samples;
  for (int row = square.row - square.half_px; row <= square.row + square.half_px; row += step) {
    for (int column = square.column - square.half_px; column <= square.column + square.half_px;
         column += step) {
      const PixelStatistics& pixel = pixelAt(pixels, column, row);
      if (rests(pixel, frames))
        samples.push_back({static_cast<double>(column), static_cast<double>(row), pixel.mean});
    }
  }
  return samples;
}

std::optional<RestingSurface> surfaceIn(const Square& square, std::span<const PixelStatistics> pixels,
                                        std::size_t frames, const rt::DepthModelParameters& camera) {
  const int step = std::max(1, square.half_px / 16);
  const auto fit =
      fitDisparity(samplesOf(pixels, frames, square, step), square.column, square.row, square.half_px);
  if (!fit || fit->residual_raw > kMostResidual_raw || fit->outlier_share > kMostOutliers)
    return std::nullopt;
  RestingSurface surface{.fit = fit->quadratic,
                         .column = static_cast<double>(square.column),
                         .row = static_cast<double>(square.row),
                         .half_px = square.half_px,
                         .residual_raw = fit->residual_raw};
  const SurfacePoint middle = surfacePoint(camera, surface.fit, surface.column, surface.row);
  surface.distance_m = -middle.position_m.z;
  if (curvatureOf(camera, surface) > 1 / kLeastRadius_m) return std::nullopt;
  const double side_px = 2 * square.half_px + 1;
  const double error_raw = fitError(fit->residual_raw, side_px * side_px, kTermsOfQuadratic);
  surface.fit_error_m = error_raw * metresPerRaw(camera, surface.distance_m) * middle.normal.z;
  return surface;
}

/// The square of `size_m` around a pixel, if it is in the image.
std::optional<Square> squareAround(int column, int row, double size_m, double distance_m,
                                   const rt::DepthModelParameters& camera) {
  const Square square{column, row, static_cast<int>(std::lround(size_m * camera.fx_px / distance_m / 2))};
  const bool inside = column - square.half_px >= 0 && row - square.half_px >= 0 &&
                      column + square.half_px < drivers::kKinectWidth &&
                      row + square.half_px < drivers::kKinectHeight;
  if (!inside || square.half_px < kLeastHalf_px) return std::nullopt;
  return square;
}

/// Returns all candidates of one size.
std::vector<RestingSurface> candidates(std::span<const PixelStatistics> pixels, std::size_t frames,
                                       RestingCount& resting, const rt::DepthModelParameters& camera,
                                       double size_m, std::span<const double> borders_m) {
  constexpr int kStride_px = 8;
  std::vector<RestingSurface> found;
  for (int row = 0; row < drivers::kKinectHeight; row += kStride_px) {
    for (int column = 0; column < drivers::kKinectWidth; column += kStride_px) {
      const PixelStatistics& middle = pixelAt(pixels, column, row);
      const double inverse_depth = camera.a_per_m * double{middle.mean} + camera.b_per_m;
      if (!rests(middle, frames) || inverse_depth <= 0) continue;
      const double distance_m = 1 / inverse_depth;
      if (distance_m < borders_m.front() || distance_m >= borders_m.back()) continue;
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
  std::size_t index = 0;
  while (index + 2 < borders_m.size() && distance_m >= borders_m[index + 1]) ++index;
  return index;
}

double fitError(double residual_raw, double pixels, int terms) {
  // The pattern is white noise smoothed by a box of 9 x 9 pixels: the covariance adds up to the variance
  // times the box's area.
  constexpr double kCorrelationArea_px = 81;
  const double samples = pixels / kCorrelationArea_px;
  // A fit takes some of the pattern for the surface, so that less of it is left about it.
  const double share_left = std::max(1 - terms / samples, 0.1);
  return residual_raw / std::sqrt(share_left) * std::sqrt(terms / samples);
}

std::vector<RestingSurface> restingSurfaces(std::span<const PixelStatistics> pixels, std::size_t frames,
                                            const rt::DepthModelParameters& camera,
                                            const RestingSurfaceOptions& options) {
  RestingCount resting(pixels, frames);
  std::vector<RestingSurface> chosen;
  for (const double size_m : options.sizes_m) {
    std::vector<RestingSurface> found =
        candidates(pixels, frames, resting, camera, size_m, options.class_borders_m);
    std::ranges::stable_sort(found, {}, &RestingSurface::residual_raw);
    std::vector<int> of_class(options.class_borders_m.size(), 0);
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
