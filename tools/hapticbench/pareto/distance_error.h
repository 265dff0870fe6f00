// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {

/// The kind of surface that is stroked.
enum class SurfaceKind : std::uint8_t {
  flat,    ///< planes, facing the camera and turned by 30 degrees
  curved,  ///< a ball of 100 mm and a rod of 80 mm
  moving,  ///< a plane at 0.3 m/s, judged at the time of each tick
};
inline constexpr std::array kSurfaceKinds{SurfaceKind::flat, SurfaceKind::curved, SurfaceKind::moving};
std::string_view nameOf(SurfaceKind kind);

/// Error of a law as shipped in strokes 8 mm deep over one kind of surface.
struct DistanceError {
  std::string law;
  SceneNoise noise = SceneNoise::sensor;
  double distance_m = 0;
  SurfaceKind kind = SurfaceKind::flat;
  double rms_jnd = 0;
  double lost_percent = 0;         ///< of the contact
  std::optional<double> by_floor;  ///< RMS error over the least that the sensor's noise allows
};

struct DistanceErrorOptions {
  std::vector<std::string> laws{"nearest_springs", "smooth_springs", "proxy", "surface"};
  std::vector<double> distances_m{0.6, 1, 1.5, 2, 3};
  std::vector<SceneNoise> noises{SceneNoise::sensor, SceneNoise::harsh};
  std::vector<SurfaceKind> kinds{kSurfaceKinds.begin(), kSurfaceKinds.end()};
  int variants = 2;  ///< strokes over each scene
};

/// Returns one row for each combination, in the order of laws, noises, distances and kinds.
std::vector<DistanceError> measureDistanceErrors(
    const DistanceErrorOptions& options, const std::function<void(const std::string&)>& progress = {});

/// Limits by the sensor's noise and pixels at a distance, for any law. Errors in just noticeable
/// differences of 4 N at 500 N/m.
struct SensorLimit {
  SceneNoise noise = SceneNoise::sensor;
  double distance_m = 0;
  double raw_unit_mm = 0;       ///< what one step of the sensor is in depth
  double narrowest_mm = 0;      ///< body that spans eight pixels
  double flat_40_mm_jnd = 0;    ///< least error on a flat patch with sides of 40 mm
  double flat_160_mm_jnd = 0;   ///< of 160 mm
  double curved_40_mm_jnd = 0;  ///< on a curved patch of 40 mm
};

/// Returns the limits, ordered by noise and then by distance.
std::vector<SensorLimit> sensorLimits(const std::vector<SceneNoise>& noises,
                                      const std::vector<double>& distances_m);

}  // namespace hapticd::tools
