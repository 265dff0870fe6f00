// SPDX-License-Identifier: Apache-2.0
#include "config/additions/addition_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "config/additions/addition_checks.h"
#include "config/additions/addition_fields.h"
#include "config/additions/addition_item_reader.h"
#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

constexpr std::string_view kLabelImage = "label_image";
constexpr std::size_t kMaxTextLength = std::size_t{1} << 20;
constexpr std::size_t kMaxErrors = 100;

template <typename Owner>
std::vector<Owner> listFrom(const YamlNode& node, bool complete, std::vector<PlacedAdditionError>& errors) {
  const std::string_view noun = nounOf(Owner{});
  if (node.type != YamlNode::Type::list) {
    const std::string name = fmt::format("{}s", noun);
    errors.push_back({node.line,
                      {"",
                       name,
                       {name, fmt::format("is not a list of {}", name),
                        fmt::format("write each {} as an item: `- name: ...`", noun)}}});
    return {};
  }
  std::vector<Owner> owners;
  const std::size_t errors_before = errors.size();
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    const bool whole = complete || i + 1 < node.items.size();
    const Owner defaults;
    ItemReader<Owner> reader(node.items[i], defaults, fmt::format("{} {} of the list", noun, i + 1), whole,
                             false);
    owners.push_back(reader.read(errors));
  }
  const std::span<const Owner> all(owners);
  const auto take = [&](std::vector<ItemError> found) {
    for (ItemError& error : found) errors.push_back({node.items[error.index].line, std::move(error.error)});
  };
  // A width that could not be read is unknown.
  if (errors.size() == errors_before) take(unlikeTransitions(all));
  take(duplicateNames(all));
  if (auto surplus = tooMany(all, node.items.size())) errors.push_back({node.line, std::move(*surplus)});
  return owners;
}

void takeScalarGroup(const YamlGroup& group, bool has_list, AdditionsRead& read) {
  if (group.name == kLabelImage) {
    read.lists.label_image = group.scalar.value_or("");
  } else if (group.scalar) {
    read.errors.push_back({group.line,
                           {"",
                            group.name,
                            {group.name, fmt::format("{} is not a list", base::inQuotes(*group.scalar)),
                             fmt::format("write it as a list of mappings, or as `{}: []`", group.name)}}});
  } else if (!has_list && group.name == "frames") {
    read.lists.frames.emplace();
  } else if (!has_list && group.name == "fixtures") {
    read.lists.fixtures.emplace();
  } else if (!has_list) {
    read.lists.regions.emplace();
  }
}

AdditionError placed(AdditionError error, int line, const std::string& file) {
  std::string place = line > 0 ? fmt::format("{}:{}", file, line) : file;
  error.error.where = error.error.where.empty() ? place : fmt::format("{}: {}", place, error.error.where);
  return error;
}

/// The problems of the file itself, in the order of the lines with those of the lists.
std::vector<AdditionError> allErrors(const YamlFile& file, std::vector<PlacedAdditionError> errors,
                                     const std::string& name) {
  for (const YamlProblem& problem : file.problems) {
    errors.push_back({problem.line, {"", problem.where, {problem.where, problem.what, problem.remedy}}});
  }
  std::ranges::stable_sort(errors, {}, &PlacedAdditionError::line);
  std::vector<AdditionError> all;
  for (PlacedAdditionError& error : errors) {
    if (all.size() == kMaxErrors) {
      all.push_back({"", "", {name, fmt::format("{} more problems", errors.size() - kMaxErrors), ""}});
      break;
    }
    all.push_back(placed(std::move(error.error), error.line, name));
  }
  return all;
}

/// `of_model`: the file may also contain kLandmarkGroup.
void checkAdditionGroups(const YamlFile& file, bool of_model, std::vector<PlacedAdditionError>& errors) {
  for (const YamlGroup& group : file.groups) {
    const bool landmarks = group.name == kLandmarkGroup;
    if (isAdditionGroup(group.name) || (of_model && landmarks)) continue;
    const std::string guess =
        landmarks ? "what is in the frame of a model is imported with 'hapticctl fixture import --landmarks'"
                  : base::didYouMean(group.name, kAdditionGroups);
    errors.push_back(
        {group.line,
         {"",
          "",
          {base::inQuotes(group.name), "is not one of the lists",
           guess.empty() ? fmt::format("lists: {}", fmt::join(kAdditionGroups, ", ")) : guess}}});
  }
}

template <typename Owner>
std::vector<Owner> withOrigins(std::vector<Owner> owners, const std::vector<Owner>& before, Origin origin) {
  for (Owner& owner : owners) {
    const auto same = std::ranges::find(before, owner);
    owner.origin.value = same == before.end() ? origin : same->origin.value;
  }
  return owners;
}

template <typename Owner>
std::expected<Owner, std::vector<AdditionError>> changedBy(const Owner& owner, const YamlNode& members) {
  std::vector<PlacedAdditionError> errors;
  ItemReader<Owner> reader(members, owner, std::string(nounOf(owner)), true, true);
  Owner result = reader.read(errors);
  if (errors.empty()) return result;
  std::vector<AdditionError> all;
  for (PlacedAdditionError& error : errors) all.push_back(std::move(error.error));
  return std::unexpected(std::move(all));
}

std::expected<SceneAdditions, std::vector<AdditionError>> additionsOf(std::string_view text,
                                                                      const std::string& name,
                                                                      bool of_model) {
  if (text.size() > kMaxTextLength) {
    return std::unexpected(std::vector{AdditionError{
        "", "", {name, "is longer than 1 MiB", "a path has at most 256 points; leave out the others"}}});
  }
  const YamlFile file = readYaml(text);
  AdditionsRead read = additionsIn(file);
  checkAdditionGroups(file, of_model, read.errors);
  for (const YamlEntry& entry : file.entries) {
    if (!isAdditionGroup(entry.group)) continue;
    read.errors.push_back(
        {entry.line, {"", entry.group, {entry.group, "is a mapping", "write the path of a PGM file"}}});
  }
  if (!read.errors.empty() || !file.problems.empty()) {
    return std::unexpected(allErrors(file, std::move(read.errors), name));
  }
  SceneAdditions additions;
  read.lists.applyTo(additions);
  if (std::vector<AdditionError> errors = checkTogether(additions); !errors.empty()) {
    for (AdditionError& error : errors) error = placed(std::move(error), 0, name);
    return std::unexpected(std::move(errors));
  }
  return additions;
}

}  // namespace

void AdditionLists::applyTo(SceneAdditions& additions, Origin origin) const {
  if (frames) additions.frames = withOrigins(*frames, additions.frames, origin);
  if (fixtures) additions.fixtures = withOrigins(*fixtures, additions.fixtures, origin);
  if (regions) additions.regions = withOrigins(*regions, additions.regions, origin);
  if (!label_image || *label_image == additions.label_image) return;
  additions.label_image = *label_image;
  additions.label_image_origin.value = origin;
}

bool isAdditionGroup(std::string_view name) {
  return std::ranges::find(kAdditionGroups, name) != kAdditionGroups.end();
}

AdditionsRead additionsIn(const YamlFile& file) {
  AdditionsRead read;
  for (const YamlGroup& group : file.groups) {
    if (!isAdditionGroup(group.name)) continue;
    const bool has_list = std::ranges::find(file.lists, group.name, &YamlList::name) != file.lists.end();
    takeScalarGroup(group, has_list, read);
  }
  for (const YamlList& list : file.lists) {
    if (list.name == "frames") {
      read.lists.frames = listFrom<FrameSettings>(list.node, file.complete, read.errors);
    } else if (list.name == "fixtures") {
      read.lists.fixtures = listFrom<FixtureSettings>(list.node, file.complete, read.errors);
    } else if (list.name == "regions") {
      read.lists.regions = listFrom<RegionSettings>(list.node, file.complete, read.errors);
    }
  }
  return read;
}

std::expected<SceneAdditions, std::vector<AdditionError>> additionsFromText(std::string_view text,
                                                                            const std::string& name) {
  return additionsOf(text, name, false);
}

std::expected<SceneAdditions, std::vector<AdditionError>> modelAdditionsFromText(std::string_view text,
                                                                                 const std::string& name) {
  return additionsOf(text, name, true);
}

template <typename Owner>
std::expected<std::vector<Owner>, std::vector<AdditionError>> definitionsFrom(const YamlNode& list,
                                                                              const std::string& name) {
  std::vector<PlacedAdditionError> errors;
  std::vector<Owner> owners = listFrom<Owner>(list, true, errors);
  if (errors.empty()) return owners;
  std::vector<AdditionError> all;
  for (PlacedAdditionError& error : errors) {
    all.push_back(name.empty() ? std::move(error.error) : placed(std::move(error.error), 0, name));
  }
  return std::unexpected(std::move(all));
}
template std::expected<std::vector<FixtureSettings>, std::vector<AdditionError>>
definitionsFrom<FixtureSettings>(const YamlNode&, const std::string&);
template std::expected<std::vector<RegionSettings>, std::vector<AdditionError>>
definitionsFrom<RegionSettings>(const YamlNode&, const std::string&);

std::expected<FixtureSettings, std::vector<AdditionError>> changed(const FixtureSettings& fixture,
                                                                   const YamlNode& members) {
  return changedBy(fixture, members);
}

std::expected<RegionSettings, std::vector<AdditionError>> changed(const RegionSettings& region,
                                                                  const YamlNode& members) {
  return changedBy(region, members);
}

}  // namespace hapticd::config
