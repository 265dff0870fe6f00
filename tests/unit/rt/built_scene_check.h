// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/depth_frame.h"
#include "rt/scene.h"
#include "tools/lib/oracle/reference_camera.h"

namespace hapticd::test {

/// Expects that the scene's voxels, ranks and ranges are consistent, and that each voxel's range holds the
/// points whose position is in that voxel (points near its border within the accuracy of the positions).
void expectVoxelsToHoldTheirPoints(const rt::Scene& scene);

/// Expects that the scene contains each point of the frame within its ball exactly once, at the right
/// position, and none that is farther away than the ball's radius plus twice the accuracy of positions.
/// `cloud`: all points of the frame.
void expectAllPointsOfTheBall(const rt::Scene& scene, const tools::PointCloud& cloud);

/// Expects that two scenes are bitwise equal.
void expectTheSameScene(const rt::Scene& actual, const rt::Scene& expected);

}  // namespace hapticd::test
