#pragma once

#include <string>

#include "tools/hapticbench/occlusion/occlusion_study.h"

namespace hapticd::tools {

/// The tables for people.
std::string occlusionTable(const OcclusionResult& result);

/// The same for programs, as JSON.
std::string occlusionJson(const OcclusionResult& result);

}  // namespace hapticd::tools
