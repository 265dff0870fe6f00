// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticbench/occlusion/occlusion_study.h"

namespace hapticd::tools {

/// The tables for people.
std::string occlusionTable(const OcclusionResult& result, const OcclusionOptions& options);

/// The same for programs, as JSON.
std::string occlusionJson(const OcclusionResult& result, const OcclusionOptions& options);

}  // namespace hapticd::tools
