#include "tools/hapticbench/recordings/recordings_study.h"

#include <fmt/format.h>

namespace hapticd::tools {

SessionResult measureSession(const BenchSequence& session, const RecordingsOptions& options,
                             const std::function<void(const std::string&)>& progress) {
  const rt::DepthModelParameters camera;
  SessionResult result{.session = session.name, .frames = session.frames.size(), .surfaces = {}};
  progress(fmt::format("{}: resting surfaces", session.name));
  const std::vector<PixelStatistics> pixels = pixelStatistics(session);
  const auto surfaces = restingSurfaces(pixels, session.frames.size(), camera, options.surfaces);
  for (const RestingSurface& surface : surfaces) {
    for (const config::LawChoice law : options.laws) {
      progress(fmt::format("{}: {} on {:.2f} m at {:.2f} m", session.name, nameOf(law), surface.size_m,
                           surface.distance_m));
      SurfaceRow row{.session = session.name, .surface = surface, .law = law, .stroke = {}, .still = {}};
      row.stiffness_n_per_m = shippedParameters(law, surface.distance_m).springs.stiffness_n_per_m;
      row.stroke = handleWith(law, session, surface, camera, Handling::along_row);
      row.stroke.add(handleWith(law, session, surface, camera, Handling::along_column));
      row.still = handleWith(law, session, surface, camera, Handling::still);
      result.surfaces.push_back(std::move(row));
    }
  }
  return result;
}

}  // namespace hapticd::tools
