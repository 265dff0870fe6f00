// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "tools/hapticbench/bound.h"
#include "tools/hapticbench/recordings/recordings_study.h"

namespace hapticd::tools {

/// All surfaces of a class of distances under one law.
struct DistanceClassResult {
  config::LawChoice law;
  double from_m = 0;
  double to_m = 0;
  int surfaces = 0;
  double fit_error_n = 0;  ///< root of the mean square of the fits' own errors
  double jnd_n = 0;        ///< just noticeable difference from the true force
  SurfaceError stroke;
  SurfaceError still;
};

/// In the order of laws and distances, those with surfaces alone. `least_size_m`: of the surfaces.
std::vector<DistanceClassResult> byDistance(std::span<const SessionResult> sessions,
                                            const RecordingsOptions& options, double least_size_m);

/// What the laws must keep on recordings.
std::vector<Bound> recordingsBounds(std::span<const SessionResult> sessions,
                                    const RecordingsOptions& options);

}  // namespace hapticd::tools
