// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/additions/addition_fields.h"
#include "config/settings/fixture_settings.h"
#include "config/yaml/yaml_reader.h"

namespace hapticd::config {

/// The lists that a text contains; a list that it does not contain is to stay as it is.
struct AdditionLists {
  std::optional<std::vector<FrameSettings>> frames;
  std::optional<std::vector<FixtureSettings>> fixtures;
  std::optional<std::vector<RegionSettings>> regions;
  std::optional<std::string> label_image;

  bool empty() const { return !frames && !fixtures && !regions && !label_image; }
  /// Replaces the lists of `additions`. What they define as it is there already keeps its origin, and the
  /// rest has `origin`. The caller must then check the whole (checkTogether).
  void applyTo(SceneAdditions& additions, Origin origin = Origin::configuration) const;

  friend bool operator==(const AdditionLists&, const AdditionLists&) = default;
};

/// An error with its line, 1 for the first.
struct PlacedAdditionError {
  int line = 0;
  AdditionError error;
};

/// What has been read, and everything that is wrong with it by itself.
struct AdditionsRead {
  AdditionLists lists;
  std::vector<PlacedAdditionError> errors;
};

/// The groups of a file that hold the lists, and the label image.
inline constexpr std::array<std::string_view, 4> kAdditionGroups{"frames", "fixtures", "regions",
                                                                 "label_image"};

/// The group with the landmarks of a model, which may be in the same file as its fixtures and regions.
inline constexpr std::string_view kLandmarkGroup = "landmarks";

/// Whether the group `name` is one of kAdditionGroups.
bool isAdditionGroup(std::string_view name);

/// Reads the lists of a file. The problems of the file itself are left to the caller.
AdditionsRead additionsIn(const YamlFile& file);

/// Reads a list of definitions that is not in a file, such as one of a call, and checks each and the list as
/// a whole. `name`: what messages call its origin; empty: nothing.
/// Errors: each with name, field, reason and remedy.
template <Added Item>
std::expected<std::vector<Item>, std::vector<AdditionError>> definitionsFrom(const YamlNode& list,
                                                                             const std::string& name);
extern template std::expected<std::vector<FixtureSettings>, std::vector<AdditionError>>
definitionsFrom<FixtureSettings>(const YamlNode&, const std::string&);
extern template std::expected<std::vector<RegionSettings>, std::vector<AdditionError>>
definitionsFrom<RegionSettings>(const YamlNode&, const std::string&);

/// Applies the members in a mapping to a fixture, region or frame, which keeps all others.
/// Returns what is wrong: as above; for an unknown member the nearest names. The item is of no use then.
std::vector<AdditionError> change(const ChangeableAddition& item, const YamlNode& members);

/// Returns it with these changes.
template <Added Item>
std::expected<Item, std::vector<AdditionError>> changed(Item item, const YamlNode& members) {
  if (auto errors = change(item, members); !errors.empty()) return std::unexpected(std::move(errors));
  return item;
}

/// additionsFromText() for what was made in the frame of a model: the text may also contain kLandmarkGroup,
/// which is left to another reader.
std::expected<SceneAdditions, std::vector<AdditionError>> modelAdditionsFromText(std::string_view text,
                                                                                 const std::string& name);

}  // namespace hapticd::config
