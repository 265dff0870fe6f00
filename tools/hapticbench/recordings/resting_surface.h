// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/recordings/disparity_fit.h"
#include "tools/hapticbench/recordings/pixel_statistics.h"

namespace hapticd::tools {

/// A smooth surface at rest in a recording, known by a fit to the mean of all frames.
struct RestingSurface {
  DisparityQuadratic fit;
  double column = 0;  ///< of the middle
  double row = 0;
  int half_px = 0;          ///< the fit reaches that far to each side
  double size_m = 0;        ///< side of the square that was fitted
  double distance_m = 0;    ///< of the middle along the optical axis
  double residual_raw = 0;  ///< standard deviation of the mean image about the fit: the static pattern
  double fit_error_m = 0;   ///< standard error of the fit along the normal, RMS over the surface
};

struct RestingSurfaceOptions {
  std::vector<double> sizes_m{0.16, 0.32, 0.64};
  /// Between classes of distances within the camera's limits; the first and the last class have no other.
  std::vector<double> class_borders_m{0.1, 0.15, 0.25, 0.4, 0.75, 1.2, 1.6, 2.2, 3.2};
  int most_per_class = 2;  ///< surfaces of one size in one class of distances, which do not overlap
};

/// The flattest squares of each size and class of distances. `pixels`: of pixelStatistics().
std::vector<RestingSurface> restingSurfaces(std::span<const PixelStatistics> pixels, std::size_t frames,
                                            const CameraDisparity& camera,
                                            const RestingSurfaceOptions& options);

/// The class of a distance: how many of `borders_m` are not above it.
std::size_t distanceClassOf(double distance_m, std::span<const double> borders_m);

/// Standard error of a fit with `terms` terms to a square of so many pixels of a mean image, RMS over the
/// square, raw units: what of the static pattern it takes for the surface. `residual_raw`: standard
/// deviation about the fit. `correlation_px`: the pattern is white noise smoothed by a square of that side.
double fitError(double residual_raw, double pixels, int terms, double correlation_px);

}  // namespace hapticd::tools
