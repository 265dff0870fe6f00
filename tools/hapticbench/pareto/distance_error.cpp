// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/distance_error.h"

#include <algorithm>
#include <cmath>

#include "rt/parameters.h"
#include "tools/hapticbench/strokes/strokes_study.h"
#include "tools/lib/truth/noise_floor.h"

namespace hapticd::tools {
namespace {

std::vector<std::string> scenesOf(SurfaceKind kind) {
  switch (kind) {
    case SurfaceKind::flat:
      return {"plane0", "plane30"};
    case SurfaceKind::curved:
      return {"sphere100", "rod80"};
    case SurfaceKind::moving:
      return {"moving0.3"};
  }
  return {};
}

/// Sums rows that belong to the same law, noise, distance and kind of surface.
DistanceError summed(const std::vector<StrokesRow>& rows, const DistanceError& like) {
  StrokesRow sum;
  sum.noise = like.noise;
  for (const StrokesRow& row : rows) {
    if (row.law != like.law || row.noise != like.noise || row.distance_m != like.distance_m) continue;
    sum.figures.add(row.figures);
    sum.floor_n.add(row.floor_n);
  }
  DistanceError error = like;
  error.rms_jnd = sum.figures.error.error_jnd.rms();
  error.lost_percent = sum.figures.lostPercent();
  error.by_floor = sum.errorByFloor();
  return error;
}

double floor_jnd(SceneNoise noise, double distance_m, double side_m, FloorModel model) {
  return noiseFloor(sensorParameters(noise), {}, {.side_m = side_m, .distance_m = distance_m, .model = model},
                    rt::SpringParameters{}.stiffness_n_per_m)
      .force_jnd;
}

}  // namespace

std::string_view nameOf(SurfaceKind kind) {
  constexpr std::array<std::string_view, 3> kNames{"flat", "curved", "moving"};
  return kNames.at(static_cast<std::size_t>(kind));
}

std::vector<DistanceError> measureDistanceErrors(const DistanceErrorOptions& options,
                                                 const std::function<void(const std::string&)>& progress) {
  StrokesOptions strokes;
  strokes.laws = options.laws;
  strokes.distances_m = options.distances_m;
  strokes.noises = options.noises;
  strokes.variants = options.variants;
  std::vector<std::vector<StrokesRow>> rows;
  for (const SurfaceKind kind : options.kinds) {
    strokes.scenes = scenesOf(kind);
    rows.push_back(measureStrokes(strokes, progress));
  }
  std::vector<DistanceError> errors;
  for (const std::string& law : options.laws) {
    for (const SceneNoise noise : options.noises) {
      for (const double distance_m : options.distances_m) {
        for (std::size_t i = 0; i < rows.size(); ++i) {
          DistanceError like;
          like.law = law;
          like.noise = noise;
          like.distance_m = distance_m;
          like.kind = options.kinds[i];
          errors.push_back(summed(rows[i], like));
        }
      }
    }
  }
  return errors;
}

std::vector<SensorLimit> sensorLimits(const std::vector<SceneNoise>& noises,
                                      const std::vector<double>& distances_m) {
  constexpr double kPixelsOfBody = 8;
  const rt::DepthModelParameters camera;
  std::vector<SensorLimit> limits;
  for (const SceneNoise noise : noises) {
    for (const double distance_m : distances_m) {
      limits.push_back({.noise = noise,
                        .distance_m = distance_m,
                        .raw_unit_mm = 1000 * std::abs(camera.a_per_m) * distance_m * distance_m,
                        .narrowest_mm = 1000 * kPixelsOfBody * distance_m / camera.fx_px,
                        .flat_40_mm_jnd = floor_jnd(noise, distance_m, 0.04, FloorModel::plane),
                        .flat_160_mm_jnd = floor_jnd(noise, distance_m, 0.16, FloorModel::plane),
                        .curved_40_mm_jnd = floor_jnd(noise, distance_m, 0.04, FloorModel::quadratic)});
    }
  }
  return limits;
}

}  // namespace hapticd::tools
