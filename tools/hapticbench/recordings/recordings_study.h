// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/law_setting.h"
#include "tools/hapticbench/recordings/passing_error.h"
#include "tools/hapticbench/recordings/resting_surface.h"
#include "tools/hapticbench/recordings/surface_error.h"

namespace hapticd::tools {

struct RecordingsOptions {
  std::vector<std::string> laws = kProxyLawChoices;
  RestingSurfaceOptions surfaces;
  int passed_places = 10;  ///< of each session: with a free and with a pressing HIP
};

/// One law on one resting surface.
struct SurfaceRow {
  RestingSurface surface{};
  std::string law;
  double stiffness_n_per_m = 500;
  SurfaceError stroke{};  ///< two strokes, along row and column
  SurfaceError still{};
};

/// One law at the positions in front of which something passes.
struct PassingRow {
  std::string law;
  int places = 0;
  double nearest_m = 0;  ///< of the positions
  double farthest_m = 0;
  PassingError free{};      ///< 30 mm in front of the surfaces
  PassingError pressing{};  ///< 6 mm behind them
};

/// The figures of a session.
struct SessionResult {
  std::string session;
  std::size_t frames = 0;
  rt::DepthModelParameters camera{};  ///< that recorded it
  double disparity_unit_m = 0;        ///< one of its raw disparities at 1 m
  std::vector<SurfaceRow> surfaces{};
  std::vector<PassingRow> passings{};
};

/// Calls `progress` with what is measured next.
SessionResult measureSession(const BenchSequence& session, const RecordingsOptions& options,
                             const std::function<void(const std::string&)>& progress);

/// The figures and the requirements, for people and for programs.
std::string recordingsText(std::span<const SessionResult> sessions, const RecordingsOptions& options);
std::string recordingsJson(std::span<const SessionResult> sessions, const RecordingsOptions& options);

}  // namespace hapticd::tools
