// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/depth_frame.h"
#include "rt/scene.h"
#include "tests/unit/rt/reference_camera.h"

namespace hapticd::test {

/// Expects that the scene's voxels, ranks and ranges are consistent, and that each voxel's range holds the
/// points whose position lies in that voxel, those at its border to the accuracy of the positions.
void expectVoxelsToHoldTheirPoints(const rt::Scene& scene);

/// Expects that the scene holds each point of the frame within the scene's ball once, none that is farther
/// away than the ball and twice the accuracy of positions, and each at its place. `cloud` is of the frame.
void expectAllPointsOfTheBall(const rt::Scene& scene, const PointCloud& cloud);

/// Expects that two scenes are the same to the last bit.
void expectTheSameScene(const rt::Scene& actual, const rt::Scene& expected);

}  // namespace hapticd::test
