// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/addition_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

#include "config/additions/addition_checks.h"
#include "config/additions/addition_fields.h"
#include "config/additions/addition_json.h"
#include "config/additions/addition_reader.h"
#include "config/base/value_text.h"
#include "rt/fixtures/fixture.h"
#include "rt/tissue/tissue.h"

namespace hapticd::daemon {
namespace {

using config::AdditionError;

constexpr const char* kDefinitionRemedy =
    "give an object with the members that the configuration has, see man 5 hapticd.yaml";
/// Longest definition in an entry of the journal.
constexpr std::size_t kMaxValueLength = 4000;

AdditionError problem(const std::string& name, std::string field, std::string what, std::string remedy) {
  return {name, std::move(field), {name, std::move(what), std::move(remedy)}};
}

AdditionError unknownName(const config::AdditionSpan& items, const std::string& name) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < items.size(); ++i) names.push_back(items[i].name());
  const std::string guess = base::didYouMean(name, std::vector<std::string_view>(names.begin(), names.end()));
  const std::string_view noun = items.type().noun;
  return problem(name, "", fmt::format("there is no {} of this name", noun),
                 guess.empty() ? fmt::format("'hapticctl {} list' shows those that there are", noun) : guess);
}

std::string nameIn(const Json& object) {
  const auto name = object.is_object() ? object.find("name") : object.end();
  return name != object.end() && name->is_string() ? name->get<std::string>() : "";
}

std::string textOf(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Returns what an element of a list is, where it should be something else.
const char* typeOf(const Json& json) {
  if (json.is_null()) return "null";
  if (json.is_boolean()) return "a truth value";
  if (json.is_number()) return "a number";
  if (json.is_string()) return "a text";
  return json.is_array() ? "a list" : "an object";
}

/// A change of a list with everything that is wrong with it.
template <typename T>
class ListChange {
 public:
  using List = std::vector<T> config::SceneAdditions::*;

  ListChange(config::SceneAdditions& additions, List list)
      : list_(list), items_(additions.*list), label_image_(additions.label_image) {}

  std::vector<AdditionError> apply(const AdditionChange& change) {
    remove(change.remove);
    alter(change.change);
    add(change.add);
    return std::move(problems_);
  }

 private:
  void report(const std::string& name, std::string field, std::string what, std::string remedy) {
    problems_.push_back(problem(name, std::move(field), std::move(what), std::move(remedy)));
  }
  /// Returns whether a list has more elements than there can be, which are not looked at then.
  bool isTooLong(const std::vector<Json>& list, const char* verb) {
    if (list.size() <= type_.most) return false;
    report("", "",
           fmt::format("the call names {} {} to {}, and there are at most {}", list.size(), type_.list, verb,
                       type_.most),
           "name each of them once");
    return true;
  }
  std::string placeOf(std::size_t index, const char* list) const {
    return fmt::format("{} {} of the list '{}'", type_.noun, index + 1, list);
  }
  auto find(const std::string& name) { return std::ranges::find(items_, name, &T::name); }

  void remove(const std::vector<Json>& names) {
    if (isTooLong(names, "remove")) return;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!names[i].is_string()) {
        report("", "", fmt::format("{} is {}, not a name", placeOf(i, "remove"), typeOf(names[i])),
               "give the names as texts");
      } else if (const auto found = find(names[i].get<std::string>()); found != items_.end()) {
        items_.erase(found);
      } else {
        problems_.push_back(unknownName(items_, names[i].get<std::string>()));
      }
    }
  }

  void alter(const std::vector<Json>& changes) {
    if (isTooLong(changes, "change")) return;
    for (std::size_t i = 0; i < changes.size(); ++i) {
      const std::string name = nameIn(changes[i]);
      if (!changes[i].is_object()) {
        report("", "", fmt::format("{} is {}, not an object", placeOf(i, "change"), typeOf(changes[i])),
               "give an object with the name and the members to change");
      } else if (name.empty()) {
        report("", "name", fmt::format("{} names nothing to change", placeOf(i, "change")),
               "give the name with each change");
      } else if (const auto found = find(name); found == items_.end()) {
        problems_.push_back(unknownName(items_, name));
      } else {
        Json members = changes[i];
        members.erase("name");
        auto changed = config::changed(*found, config::nodeOf(members));
        if (changed) {
          *found = std::move(*changed);
        } else {
          std::ranges::move(changed.error(), std::back_inserter(problems_));
        }
      }
    }
  }

  void add(const std::vector<Json>& definitions) {
    if (definitions.empty()) return;
    const std::size_t count = items_.size() + definitions.size();
    if (count > type_.most) {
      report(nameIn(definitions[type_.most - std::min(type_.most, items_.size())]), "",
             fmt::format("there would be {} {}, and at most {} are possible", count, type_.list, type_.most),
             fmt::format("remove {}", count - type_.most));
    }
    Json objects = Json::array();
    for (std::size_t i = 0; i < std::min(definitions.size(), type_.most); ++i) {
      if (definitions[i].is_object()) {
        objects.push_back(definitions[i]);
      } else {
        report("", "", fmt::format("{} is {}, not a definition", placeOf(i, "add"), typeOf(definitions[i])),
               kDefinitionRemedy);
      }
    }
    auto added = config::definitionsFrom<T>(config::nodeOf(objects), "");
    auto refused = added ? problemsOf(*added) : std::move(added.error());
    if (!refused.empty()) {
      for (AdditionError& error : refused) problems_.push_back(withPlace(std::move(error)));
      for (const Json& definition : objects) {
        if (const std::string name = nameIn(definition); find(name) != items_.end())
          report(name, "name", fmt::format("there is a {} of this name already", type_.noun),
                 "give each its own name");
      }
      return;
    }
    for (T& item : *added) item.origin.value = config::Origin::client;
    std::ranges::move(*added, std::back_inserter(items_));
  }

  /// Returns what is wrong with definitions without those that are there already.
  std::vector<AdditionError> problemsOf(const std::vector<T>& added) const {
    config::SceneAdditions alone;
    alone.*list_ = added;
    alone.label_image = label_image_;
    return config::checkTogether(alone);
  }

  /// Says in the text which one it is, where it has no name.
  static AdditionError withPlace(AdditionError error) {
    if (error.name.empty() && !error.error.where.empty())
      error.error.what = fmt::format("{} {}", error.error.where, error.error.what);
    return error;
  }

  const config::AdditionType& type_ = typeOf(T{});
  List list_;
  std::vector<T>& items_;
  const std::string& label_image_;
  std::vector<AdditionError> problems_;
};

std::string cut(std::string text) {
  if (text.size() <= kMaxValueLength) return text;
  text.resize(kMaxValueLength);
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

/// enable and disable: nothing else has changed.
std::string actionOf(const Json& changed) {
  const auto enabled = changed.find("enabled");
  if (changed.size() != 1 || enabled == changed.end() || !enabled->is_boolean()) return "change";
  return enabled->get<bool>() ? "enable" : "disable";
}

/// `before`, `after`: null where there is none.
AdditionDifference differenceOf(const config::Addition* before, const config::Addition* after) {
  const config::Addition& item = before != nullptr ? *before : *after;
  const config::EventKind kind = *rt::withWord<config::EventKind>(item.type().noun);
  if (after == nullptr) return {kind, item.name(), "remove", cut(lineOf(*before)), ""};
  if (before == nullptr) return {kind, item.name(), "add", "", cut(lineOf(*after))};
  const Json old_definition = config::definitionOf<Json>(*before);
  const Json new_definition = config::definitionOf<Json>(*after);
  const Json new_members = membersWithout(new_definition, old_definition);
  return {kind, item.name(), actionOf(new_members),
          cut(textOf(membersWithout(old_definition, new_definition))), cut(textOf(new_members))};
}

template <typename T>
void addDifferences(const std::vector<T>& before, const std::vector<T>& after,
                    std::vector<AdditionDifference>& differences) {
  for (const T& item : before) {
    const config::Addition was(item);
    if (std::ranges::find(after, item.name, &T::name) == after.end())
      differences.push_back(differenceOf(&was, nullptr));
  }
  for (const T& item : after) {
    const auto old_item = std::ranges::find(before, item.name, &T::name);
    const config::Addition now(item), was(old_item == before.end() ? item : *old_item);
    if (old_item == before.end() || *old_item != item)
      differences.push_back(differenceOf(old_item == before.end() ? nullptr : &was, &now));
  }
}

}  // namespace

std::expected<config::SceneAdditions, std::vector<AdditionError>> changedAdditions(
    const config::SceneAdditions& before, AdditionList list, const AdditionChange& change) {
  config::SceneAdditions after = before;
  auto problems = list == AdditionList::fixtures
                      ? ListChange(after, &config::SceneAdditions::fixtures).apply(change)
                      : ListChange(after, &config::SceneAdditions::regions).apply(change);
  if (problems.empty()) problems = config::checkTogether(after);
  if (!problems.empty()) return std::unexpected(std::move(problems));
  return after;
}

std::string AdditionDifference::text() const {
  const std::string subject = fmt::format("{}s {} {}", action, rt::wordOf(kind), name);
  if (action == "change") return fmt::format("{} from {} to {}", subject, old_value, new_value);
  return action == "add" ? fmt::format("{}: {}", subject, new_value) : subject;
}

JournalFields AdditionDifference::fields() const {
  const char* const field = kind == config::EventKind::frame     ? "FRAME"
                            : kind == config::EventKind::fixture ? "FIXTURE"
                                                                 : "REGION";
  return {{field, name}, {"ACTION", action}, {"OLD", old_value}, {"NEW", new_value}};
}

std::vector<AdditionDifference> differencesOf(const config::SceneAdditions& before,
                                              const config::SceneAdditions& after) {
  std::vector<AdditionDifference> differences;
  config::forEachList(
      [&differences](const auto& was, const auto& now) { addDifferences(was, now, differences); }, before,
      after);
  if (before.label_image != after.label_image) {
    differences.push_back({config::EventKind::region, "label_image", "change",
                           fmt::format("{} bytes", before.label_image.size()),
                           fmt::format("{} bytes", after.label_image.size())});
  }
  return differences;
}

std::vector<config::AdditionError> missingSolids(const Box& box, const config::SceneAdditions& additions) {
  std::vector<config::AdditionError> missing;
  for (const config::FixtureSettings& fixture : additions.fixtures) {
    if (fixture.kind != rt::FixtureKind::solid || box.knowsSolid(fixture.solid)) continue;
    missing.push_back(config::additionError(
        "fixture", fixture.name, "solid", "names a solid that the box does not have",
        "send its shape with hapticctl fixture add NAME --mesh FILE, or with --labels"));
  }
  return missing;
}

}  // namespace hapticd::daemon
