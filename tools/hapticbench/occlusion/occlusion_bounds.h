// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tools/hapticbench/bound.h"
#include "tools/hapticbench/occlusion/occlusion_study.h"

namespace hapticd::tools {

/// What the laws must keep while something passes, where hands enter from the side, at the near limit and in
/// pushes.
std::vector<Bound> occlusionBounds(const OcclusionResult& result, const OcclusionOptions& options);

}  // namespace hapticd::tools
