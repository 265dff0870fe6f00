// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/settings/fixture_settings.h"

namespace hapticd::config {

/// Names of fields.
using FieldNames = std::set<std::string_view>;

/// Returns an error about a fixture or region: `where` is "fixture nerve: radius_m".
AdditionError additionError(std::string_view noun, std::string_view name, std::string_view field,
                            std::string what, std::string remedy);

/// Checks one fixture or region by itself, except the fields in `skipped`.
std::vector<AdditionError> checkAlone(const FixtureSettings& fixture, const FieldNames& skipped = {});
std::vector<AdditionError> checkAlone(const RegionSettings& region, const FieldNames& skipped = {});
std::vector<AdditionError> checkAlone(const FrameSettings& frame, const FieldNames& skipped = {});

/// An error about one fixture or region of a list, with its index.
struct ItemError {
  std::size_t index = 0;
  AdditionError error;
};

/// Returns an error for each name that an earlier fixture or region of the list has too.
std::vector<ItemError> duplicateNames(std::span<const FixtureSettings> fixtures);
std::vector<ItemError> duplicateNames(std::span<const RegionSettings> regions);
std::vector<ItemError> duplicateNames(std::span<const FrameSettings> frames);

/// Returns an error for each region of the place `label` with another transition_m than the first of them:
/// the force loop looks at the labels around the HIP once for each width.
std::vector<ItemError> unlikeTransitions(std::span<const RegionSettings> regions);
inline std::vector<ItemError> unlikeTransitions(std::span<const FixtureSettings>) {
  return {};
}
inline std::vector<ItemError> unlikeTransitions(std::span<const FrameSettings>) {
  return {};
}

/// Returns an error if there are more fixtures or regions than the force loop has room for; `count` may be
/// above the number in the list.
std::optional<AdditionError> tooMany(std::span<const FixtureSettings> fixtures, std::size_t count);
std::optional<AdditionError> tooMany(std::span<const RegionSettings> regions, std::size_t count);
std::optional<AdditionError> tooMany(std::span<const FrameSettings> frames, std::size_t count);

/// Returns an error if a fixture leaves no room for a tool of this radius: in a shape that keeps it inside,
/// or for a standoff that may reach only so far.
std::optional<AdditionError> toolProblem(const SceneAdditions& additions, double tool_radius_m);
/// Returns an error if a region needs the label image and there is none.
std::optional<AdditionError> labelImageProblem(const SceneAdditions& additions);

/// Returns what is wrong with the points of a path, all of which are finite: distances, turns, crossings.
struct PathProblem {
  std::string what;
  std::string remedy;
};
std::optional<PathProblem> pathProblem(std::span<const rt::Vec3> points_m, bool allow_crossing);

}  // namespace hapticd::config
