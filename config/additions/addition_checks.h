// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/additions/addition_fields.h"
#include "config/settings/fixture_settings.h"

namespace hapticd::config {

/// Names of fields.
using FieldNames = std::set<std::string_view>;

/// Returns an error about a fixture or region: `where` is "fixture nerve: radius_m".
AdditionError additionError(std::string_view noun, std::string_view name, std::string_view field,
                            std::string what, std::string remedy);

/// Checks one fixture, region or frame by itself, except the fields in `skipped`.
std::vector<AdditionError> checkAlone(const Addition& item, const FieldNames& skipped = {});

/// An error about one fixture or region of a list, with its index.
struct ItemError {
  std::size_t index = 0;
  AdditionError error;
};

/// Returns an error for each name that an earlier one of the list has too.
std::vector<ItemError> duplicateNames(const AdditionSpan& items);

/// Returns an error for each region of the place `label` with another transition_m than the first of them:
/// the force loop looks at the labels around the HIP once for each width.
std::vector<ItemError> unlikeTransitions(const AdditionSpan& items);

/// Returns an error if there are more than the force loop has room for; `count` may be above the number in
/// the list.
std::optional<AdditionError> tooMany(const AdditionSpan& items, std::size_t count);

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

/// What is wrong with the members of one fixture, region or frame.
class AdditionChecks {
 public:
  AdditionChecks(const Addition& item, const FieldNames& skipped) : item_(item), skipped_(skipped) {}

  /// Checks each member by itself.
  void checkFields();
  /// Whether a rule between fields can be checked.
  bool isGood(std::initializer_list<std::string_view> fields) const;
  void report(std::string_view field, std::string what, std::string remedy);
  std::vector<AdditionError> takeErrors() { return std::move(errors_); }

 private:
  void refuse(const AdditionField& field, std::string what);
  void checkField(const AdditionField& field);
  void checkText(const AdditionField& field, const std::string& text);
  bool checkVector(const AdditionField& field, const rt::Vec3& vector, const std::string& shown);
  void checkPoints(const AdditionField& field, const std::vector<rt::Vec3>& points);

  Addition item_;
  const FieldNames& skipped_;
  std::vector<AdditionError> errors_;
};

/// The rules between the members of one.
void checkRules(const FixtureSettings& fixture, AdditionChecks& checks);
void checkRules(const RegionSettings& region, AdditionChecks& checks);
void checkRules(const FrameSettings& frame, AdditionChecks& checks);

}  // namespace hapticd::config
