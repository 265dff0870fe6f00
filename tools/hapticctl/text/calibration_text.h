// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// Number of frames that a measurement of the surface's noise must rest on.
inline constexpr double kFramesOfCalibration = 60;

/// Returns what a measurement of the stiffness still needs, for people; empty: nothing.
std::string calibrationNeeds(const Json& status);

/// The largest stiffness that each rule allows, read from a status.
///   rules: list of name, nPerM (null: no limit), binds, remedy
///   stiffnessNPerM, bound, margin (of the rule that allows least after it; null: there is none),
///   distanceM, surfaceNoiseM, noiseFrames
/// `ceiling_n_per_m`: instead of the configured one.
Json calibrationOf(const Json& status, std::optional<double> ceiling_n_per_m);

/// `calibration` for people; `columns`: of the terminal.
std::string calibrationText(const Json& calibration, std::size_t columns);

}  // namespace hapticd::tools
