// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "config/settings.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/recordings/passing_error.h"
#include "tools/hapticbench/recordings/resting_surface.h"
#include "tools/hapticbench/recordings/surface_error.h"
#include "tools/hapticbench/shipped_law.h"

namespace hapticd::tools {

struct RecordingsOptions {
  std::vector<config::LawChoice> laws{kShippedLaws.begin(), kShippedLaws.end()};
  RestingSurfaceOptions surfaces;
  int passed_places = 10;  ///< of each session: with a free and with a pressing HIP
};

/// One law on one resting surface.
struct SurfaceRow {
  std::string session;
  RestingSurface surface;
  config::LawChoice law;
  double stiffness_n_per_m = 500;
  SurfaceError stroke;  ///< two strokes, along row and column
  SurfaceError still;
};

/// One law at the places that something passes.
struct PassingRow {
  std::string session;
  config::LawChoice law;
  int places = 0;
  double nearest_m = 0;  ///< of the places
  double farthest_m = 0;
  PassingError free;      ///< 30 mm in front of the surfaces
  PassingError pressing;  ///< 6 mm behind them
};

/// What was measured on a session.
struct SessionResult {
  std::string session;
  std::size_t frames = 0;
  std::vector<SurfaceRow> surfaces;
  std::vector<PassingRow> passings;
};

/// Calls `progress` with what is measured next.
SessionResult measureSession(const BenchSequence& session, const RecordingsOptions& options,
                             const std::function<void(const std::string&)>& progress);

}  // namespace hapticd::tools
