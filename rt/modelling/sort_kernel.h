// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/modelling/deproject_kernel.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {

/// Counting sort: marks the voxels of the runs in the empty grid of `scene`, ranks them and moves the runs
/// into their voxels. The ranks replace job.run_voxel. Adjacent pixels mostly fall into the same voxel, so
/// whole runs of points are moved.
/// RT: safe after the first call.  Cost: bounded by the runs, the points and the summary of the grid.
void sortIntoVoxels(const DeprojectJob& job, Scene& scene) noexcept;

}  // namespace hapticd::rt
