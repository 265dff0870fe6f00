// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"
#include "tools/lib/registration/point_files.h"
#include "tools/lib/registration/rigid_fit.h"

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

}  // namespace hapticd::tools
