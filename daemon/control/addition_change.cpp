// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/addition_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "config/nearest_names.h"
#include "config/value_text.h"

namespace hapticd::daemon {
namespace {

using config::AdditionError;
using Problem = std::optional<AdditionError>;

constexpr const char* kDefinitionRemedy =
    "give an object with the members that the configuration has, see man 5 hapticd.yaml";
/// Longest definition in an entry of the journal.
constexpr std::size_t kLongestValue = 4000;

/// The list of a type, and its words.
template <typename T>
struct ListOf;
template <>
struct ListOf<config::FixtureSettings> {
  static constexpr const char* kName = "fixtures";
  static constexpr const char* kWord = "fixture";
  static constexpr auto kEvent = config::EventKind::fixture;
  static constexpr auto kMember = &config::SceneAdditions::fixtures;
};
template <>
struct ListOf<config::RegionSettings> {
  static constexpr const char* kName = "regions";
  static constexpr const char* kWord = "region";
  static constexpr auto kEvent = config::EventKind::region;
  static constexpr auto kMember = &config::SceneAdditions::regions;
};

AdditionError problem(const std::string& name, std::string field, std::string what, std::string remedy) {
  return {name, std::move(field), {name, std::move(what), std::move(remedy)}};
}

template <typename T>
AdditionError unknownName(const std::vector<T>& items, const std::string& name) {
  std::vector<std::string_view> names;
  for (const T& item : items) names.push_back(item.name);
  const std::string guess = config::didYouMean(name, names);
  return problem(name, "", fmt::format("there is no {} of this name", ListOf<T>::kWord),
                 guess.empty()
                     ? fmt::format("'hapticctl {} list' shows those that there are", ListOf<T>::kWord)
                     : guess);
}

std::string nameIn(const Json& object) {
  const auto name = object.is_object() ? object.find("name") : object.end();
  return name != object.end() && name->is_string() ? name->get<std::string>() : "";
}

std::string textOf(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <typename T>
Problem removeFrom(std::vector<T>& items, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const auto found = std::ranges::find(items, name, &T::name);
    if (found == items.end()) return unknownName(items, name);
    items.erase(found);
  }
  return std::nullopt;
}

template <typename T>
Problem changeIn(std::vector<T>& items, const std::vector<Json>& changes) {
  for (const Json& change : changes) {
    const std::string name = nameIn(change);
    if (name.empty()) return problem("", "name", "names nothing to change", "give the name with each change");
    const auto found = std::ranges::find(items, name, &T::name);
    if (found == items.end()) return unknownName(items, name);
    Json members = change;
    members.erase("name");
    auto changed = config::changed(*found, textOf(members));
    if (!changed) return changed.error();
    *found = std::move(*changed);
  }
  return std::nullopt;
}

template <typename T>
Problem addTo(std::vector<T>& items, const std::vector<Json>& definitions, const std::string& label_image) {
  if (definitions.empty()) return std::nullopt;
  for (const Json& definition : definitions) {
    if (!definition.is_object()) return problem("", "", "is no definition", kDefinitionRemedy);
  }
  Json text = {{ListOf<T>::kName, definitions}};
  if (!label_image.empty()) text["label_image"] = label_image;
  auto read = config::additionsFromText(textOf(text), "the call");
  if (!read) return read.error().front();
  std::vector<T>& added = (*read).*ListOf<T>::kMember;
  for (T& item : added) item.origin.value = config::Origin::client;
  std::ranges::move(added, std::back_inserter(items));
  return std::nullopt;
}

template <typename T>
Problem apply(config::SceneAdditions& additions, const AdditionChange& change) {
  std::vector<T>& items = additions.*ListOf<T>::kMember;
  if (Problem wrong = removeFrom(items, change.remove)) return wrong;
  if (Problem wrong = changeIn(items, change.change)) return wrong;
  if (Problem wrong = addTo(items, change.add, additions.label_image)) return wrong;
  if (auto problems = config::checkTogether(additions); !problems.empty()) return problems.front();
  return std::nullopt;
}

std::string cut(std::string text) {
  if (text.size() <= kLongestValue) return text;
  text.resize(kLongestValue);
  return text + "...";
}

/// The members of `some` that `others` lacks or has with another value.
Json membersWithout(const Json& some, const Json& others) {
  Json members = Json::object();
  for (auto member = some.begin(); member != some.end(); ++member) {
    const auto other = others.find(member.key());
    if (other == others.end() || *other != *member) members[member.key()] = *member;
  }
  return members;
}

Json definitionOf(const auto& item) {
  return Json::parse(config::jsonOf(item), nullptr, false);
}

/// enable and disable: nothing else has changed.
std::string actionOf(const Json& changed) {
  const auto enabled = changed.find("enabled");
  if (changed.size() != 1 || enabled == changed.end() || !enabled->is_boolean()) return "change";
  return enabled->get<bool>() ? "enable" : "disable";
}

template <typename T>
AdditionDifference differenceOf(const T& before, const T& after) {
  const Json old_definition = definitionOf(before);
  const Json new_definition = definitionOf(after);
  const Json new_members = membersWithout(new_definition, old_definition);
  return {ListOf<T>::kEvent, after.name, actionOf(new_members),
          cut(textOf(membersWithout(old_definition, new_definition))), cut(textOf(new_members))};
}

template <typename T>
void addDifferences(const std::vector<T>& before, const std::vector<T>& after,
                    std::vector<AdditionDifference>& differences) {
  for (const T& item : before) {
    if (std::ranges::find(after, item.name, &T::name) == after.end())
      differences.push_back({ListOf<T>::kEvent, item.name, "remove", cut(config::jsonOf(item)), ""});
  }
  for (const T& item : after) {
    const auto old_item = std::ranges::find(before, item.name, &T::name);
    if (old_item == before.end()) {
      differences.push_back({ListOf<T>::kEvent, item.name, "add", "", cut(config::jsonOf(item))});
    } else if (*old_item != item) {
      differences.push_back(differenceOf(*old_item, item));
    }
  }
}

}  // namespace

std::expected<config::SceneAdditions, AdditionError> changedAdditions(const config::SceneAdditions& before,
                                                                      AdditionList list,
                                                                      const AdditionChange& change) {
  config::SceneAdditions after = before;
  const Problem wrong = list == AdditionList::fixtures ? apply<config::FixtureSettings>(after, change)
                                                       : apply<config::RegionSettings>(after, change);
  if (wrong) return std::unexpected(*wrong);
  return after;
}

std::string AdditionDifference::text() const {
  const std::string subject = fmt::format("{}s {} {}", action, rt::wordOf(kind), name);
  if (action == "change") return fmt::format("{} from {} to {}", subject, old_value, new_value);
  return action == "add" ? fmt::format("{}: {}", subject, new_value) : subject;
}

JournalFields AdditionDifference::fields() const {
  return {{kind == config::EventKind::fixture ? "FIXTURE" : "REGION", name},
          {"ACTION", action},
          {"OLD", old_value},
          {"NEW", new_value}};
}

std::vector<AdditionDifference> differencesOf(const config::SceneAdditions& before,
                                              const config::SceneAdditions& after) {
  std::vector<AdditionDifference> differences;
  addDifferences(before.fixtures, after.fixtures, differences);
  addDifferences(before.regions, after.regions, differences);
  if (before.label_image != after.label_image) {
    differences.push_back({config::EventKind::region, "label_image", "change",
                           fmt::format("{} bytes", before.label_image.size()),
                           fmt::format("{} bytes", after.label_image.size())});
  }
  return differences;
}

}  // namespace hapticd::daemon
