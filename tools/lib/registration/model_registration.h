// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "rt/base/parameters.h"
#include "tools/lib/registration/rigid_fit.h"

/// Fixtures and regions that were made in the frame of a model, such as a pre-operative image, in the world.
namespace hapticd::tools {

/// Moves all vectors of fixtures and regions from the frame of a model into the world: places are turned and
/// shifted, directions turned, the rotations of boxes composed; distances stay. What has no vectors, such as
/// a stand-off, stays as it is.
/// Errors: a fixture or region in the frame `camera`, a region with a label of the label image: neither is in
/// the frame of the model.
base::Result<config::SceneAdditions> movedToWorld(const config::SceneAdditions& of_model,
                                                  const rt::PoseParameters& T_world_model);

/// Mean of the centres of fixtures and regions; nothing where none has a place.
std::optional<rt::Vec3> centreOf(const config::SceneAdditions& additions);

/// Expected distance between the place where a target of the model is and where the registration puts it (the
/// target registration error), metres, root mean square. `pairs`: of which `rms_m` is the residual;
/// `target_m_in_world`: the target. The error of locating a landmark is estimated from the residuals, which
/// are smaller than it, because the registration follows the errors: rms^2 = (1 - 2/N) FLE^2.
/// Source: Fitzpatrick, West, Maurer, Predicting error in rigid-body point-based registration, 1998,
/// eq. (46): TRE^2 = FLE^2 / N (1 + 1/3 sum_k d_k^2 / f_k^2).
double expectedTargetError_m(std::span<const PointPair> pairs, double rms_m,
                             const rt::Vec3& target_m_in_world);

}  // namespace hapticd::tools
