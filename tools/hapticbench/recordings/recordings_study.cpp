// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/recordings_study.h"

#include <fmt/format.h>

#include <algorithm>

namespace hapticd::tools {

namespace {

constexpr double kFreeBefore_m = 0.03;
constexpr double kPressingBefore_m = -0.006;

SurfaceRow measureSurface(const std::string& law, const BenchSequence& session, const RestingSurface& surface,
                          const CameraDisparity& camera) {
  SurfaceRow row{.surface = surface, .law = law};
  row.stiffness_n_per_m =
      shippedParameters(law, surface.distance_m, session.camera()).springs.stiffness_n_per_m;
  row.stroke = handleWith(law, session, surface, camera, Handling::along_row);
  row.stroke.add(handleWith(law, session, surface, camera, Handling::along_column));
  row.still = handleWith(law, session, surface, camera, Handling::still);
  return row;
}

PassingRow measurePassing(const std::string& law, const BenchSequence& session,
                          const std::vector<PassedPlace>& places, const CameraDisparity& camera) {
  PassingRow row{.law = law};
  for (const PassedPlace& place : places) {
    row.nearest_m = row.places == 0 ? place.distance_m : std::min(row.nearest_m, place.distance_m);
    row.farthest_m = std::max(row.farthest_m, place.distance_m);
    ++row.places;
    row.free.add(passPlace(law, session, place, camera, kFreeBefore_m));
    row.pressing.add(passPlace(law, session, place, camera, kPressingBefore_m));
  }
  return row;
}

}  // namespace

SessionResult measureSession(const BenchSequence& session, const RecordingsOptions& options,
                             const std::function<void(const std::string&)>& progress) {
  SessionResult result{.session = session.name, .frames = session.frames.size(), .camera = session.camera()};
  progress(fmt::format("{}: resting surfaces", session.name));
  const CameraDisparity camera(cameraWithNoise(session));
  result.disparity_unit_m = camera.unit_m(1);
  const std::vector<PixelStatistics> pixels = pixelStatistics(session, camera);
  const auto surfaces = restingSurfaces(pixels, session.frames.size(), camera, options.surfaces);
  const auto places =
      passedPlaces(session, restingBackground(session, pixels, camera), camera, options.passed_places);
  for (const std::string& law : options.laws) {
    for (const RestingSurface& surface : surfaces) {
      progress(fmt::format("{}: {} on {:.2f} m at {:.2f} m", session.name, law, surface.size_m,
                           surface.distance_m));
      result.surfaces.push_back(measureSurface(law, session, surface, camera));
    }
    progress(fmt::format("{}: {} while something passes", session.name, law));
    if (!places.empty()) result.passings.push_back(measurePassing(law, session, places, camera));
  }
  return result;
}

}  // namespace hapticd::tools
