// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "rt/base/parameters.h"
#include "tools/lib/depth_noise/depth_noise.h"

namespace hapticd::tools {

/// The noise for people: a line for each depth, the correlation length, the standing share, and the lines for
/// the configuration. Says so where nothing was measured.
std::string textOf(const DepthNoiseReport& report, rt::DepthPrinciple principle);

/// The noise for programs: adds the members "noiseAtDepths" and "noise", which is null where nothing was
/// measured.
void addTo(nlohmann::ordered_json& document, const DepthNoiseReport& report, rt::DepthPrinciple principle);

}  // namespace hapticd::tools
