// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "tools/lib/registration/model_registration.h"

/// What was placed in 3D Slicer, as fixtures and landmarks. All in LPS, metres.
namespace hapticd::tools {

/// Whether the ending of a file's name is that of markups: .mrk.json or .fcsv.
inline bool isMarkupFile(std::string_view file) {
  return file.ends_with(".mrk.json") || file.ends_with(".fcsv");
}

/// Landmarks of a model.
struct ModelLandmarks {
  std::vector<PlacedLandmark> landmarks = {};
  std::set<std::string> unplaced = {};  ///< names of those that the model has, but no place of
  std::vector<std::string> notes = {};  ///< for people: what was left out
};

/// Points of a file of markups that are landmarks, named by their labels.
/// Errors: the file's; no point; two points of the same label.
base::Result<ModelLandmarks> landmarksOfMarkups(const std::string& file);

/// Fixtures made of markups.
struct MarkupFixtures {
  config::SceneAdditions additions;
  /// For people: what became of each markup, with its error, and what was left out.
  std::vector<std::string> notes;
};

/// Lines and curves become paths, a closed curve a closed path, planes and boxes forbidden regions. The names
/// are those of the markups, or of the file where they have none, as far as a fixture's name allows. Points
/// are landmarks and left out. Errors: the file's; nothing that could be a fixture; more than
/// rt::kMaxFixtures.
base::Result<MarkupFixtures> fixturesOfMarkups(const std::string& file);

}  // namespace hapticd::tools
