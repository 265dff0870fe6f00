// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "tools/lib/registration/point_files.h"
#include "tools/lib/registration/rigid_fit.h"

/// Fixtures and regions that were made in the frame of a model, such as a pre-operative image, in the world.
namespace hapticd::tools {

/// A landmark with its position, in the frame of a model or as it was measured in the world.
struct PlacedLandmark {
  std::string name;
  rt::Vec3 position_m;
};

/// Reads the list `landmarks:` of a YAML text, `[{name, position_m: [x, y, z]}]`, which messages call `file`.
/// The text may also contain fixtures and regions, which are left to another reader.
/// Errors: no such list; every wrong item, with its line; a name that is there twice.
FileOf<PlacedLandmark> landmarksFromText(std::string_view text, const std::string& file);

/// The text that reads back as the same.
std::string textOf(const std::vector<PlacedLandmark>& landmarks);

/// Pairs of the landmarks of a model that were measured, in the model's order; the model takes the place of
/// the camera. Errors: a measured landmark that the model does not have.
base::Result<std::vector<PointPair>> pairsOf(const std::vector<PlacedLandmark>& model,
                                             const std::vector<PlacedLandmark>& measured);

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
