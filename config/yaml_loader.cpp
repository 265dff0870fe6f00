// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_loader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <map>
#include <set>

#include "config/base/value_text.h"
#include "config/conflicts.h"
#include "config/settings/parameter_table.h"
#include "config/yaml/yaml_reader.h"

namespace hapticd::config {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxErrors = 100;

base::Error unreadable(const std::filesystem::path& file, const base::FileFault& fault) {
  const auto remedy = [&fault] {
    switch (fault.reason) {
      case base::FileFault::Reason::not_regular:
        return "put a regular file there, or name another one";
      case base::FileFault::Reason::too_long:
        return "check that this is the configuration file";
      case base::FileFault::Reason::unreadable:
        break;
    }
    return fault.error_number == EISDIR ? "name the YAML file in the folder"
                                        : "check the path and its permissions";
  };
  return {file.string(), fault.text(), remedy()};
}

/// The lines that mark the beginning and the end of a text.
struct Marks {
  bool begun = false;
  bool ended = false;  ///< after a beginning
};

/// A value is on one line and behind its name, so that a line that begins like this is a mark.
Marks marksIn(std::string_view text) {
  Marks marks;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (line.starts_with("---")) marks.begun = true;
    if (line.starts_with("...")) marks.ended = marks.begun;
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return marks;
}

std::vector<std::string_view> groupNames() {
  std::vector<std::string_view> names = parameterGroups();
  names.insert(names.end(), kAdditionGroups.begin(), kAdditionGroups.end());
  return names;
}

base::Error unknownGroup(const YamlGroup& group, const std::vector<std::string_view>& names) {
  if (const Parameter* parameter = findParameter(group.name); parameter != nullptr) {
    return {
        group.name, "is outside its group",
        fmt::format("write it as `{}: {{{}: {}}}`", parameter->group(), parameter->nameInGroup(),
                    group.scalar && group.scalar->size() < 40 ? base::printable(*group.scalar) : "value")};
  }
  const std::string guess = base::didYouMean(group.name, names);
  return {base::inQuotes(group.name), "there is no group of this name",
          guess.empty() ? fmt::format("groups: {}", fmt::join(names, ", ")) : guess};
}

// Fills Settings from a file and overrides, and records the errors and where each parameter was set.
class Loading {
 public:
  /// `belongs`: whether the file may contain a parameter; empty: any.
  /// With leaveOutUnknown(), names that are no parameters are collected and no errors.
  explicit Loading(std::string file_name, std::function<bool(const Parameter&)> belongs = {},
                   bool with_additions = true)
      : file_name_(std::move(file_name)), belongs_(std::move(belongs)), with_additions_(with_additions) {}

  void leaveOutUnknown() { leaves_out_unknown_ = true; }

  void take(std::string_view text) {
    const YamlFile file = readYaml(text);
    complete_ = file.complete;
    any_group_ = !file.groups.empty();
    if (const Marks marks = marksIn(text); marks.begun && !marks.ended) {
      report(0,
             {"", "begins with a line `---`, and the line `...` at its end is missing: was its end cut off?",
              "restore it; if it is complete, write `...` below its last line"});
    }
    for (const YamlProblem& problem : file.problems) {
      report(problem.line, base::Error{shortened(problem.where), problem.what, problem.remedy});
      refused_.insert(problem.where);
    }
    takeAdditions(file);
    for (const YamlGroup& group : file.groups) checkGroup(group);
    for (const YamlEntry& entry : file.entries) takeEntry(entry);
  }

  void takeOverride(const std::string& name_and_value) {
    const std::string where = "--set " + shortened(name_and_value);
    const std::string name = name_and_value.substr(0, name_and_value.find('='));
    if (const base::Result<void> result = setFromText(settings_, name_and_value); !result) {
      errors_.emplace_back(kAfterTheFile, base::Error{where, result.error().what, result.error().remedy});
      refused_.insert(name);
      return;
    }
    set_at_[name] = {kAfterTheFile, where};
  }

  /// What was cut off must not count as a request for the defaults.
  void requireGroup() {
    if (any_group_ || !errors_.empty()) return;
    report(0, {"", "has no group of parameters: is it empty, or was its end cut off?",
               "restore it; for a box with all defaults write `force:`"});
  }

  // A rule about a parameter that was refused or not read is not checked, because the intended value is
  // unknown.
  void checkRules() {
    if (!complete_) return;
    for (const Conflict& conflict : conflictsIn(settings_)) {
      const auto was_refused = [this](std::string_view name) { return refused_.contains(std::string(name)); };
      if (std::ranges::any_of(conflict.parameters, was_refused)) continue;
      errors_.push_back(placed(conflict));
    }
  }

  std::expected<Configuration, std::vector<base::Error>> finish() && {
    if (errors_.empty()) return Configuration{std::move(settings_), set_at_.size() - addition_groups_, false};
    return std::unexpected(sortedErrors());
  }

  std::expected<RecordedSettings, std::vector<base::Error>> finishRecorded() && {
    if (errors_.empty()) return RecordedSettings{std::move(settings_), std::move(unknown_)};
    return std::unexpected(sortedErrors());
  }

  std::expected<SettingsPart, std::vector<base::Error>> finishPart() && {
    if (errors_.empty()) return SettingsPart{std::move(assignments_), std::move(additions_)};
    return std::unexpected(sortedErrors());
  }

 private:
  static constexpr int kAfterTheFile = std::numeric_limits<int>::max();

  struct Place {
    int line;
    std::string text;
  };

  std::vector<base::Error> sortedErrors() {
    std::ranges::stable_sort(errors_, {}, &std::pair<int, base::Error>::first);
    std::vector<base::Error> errors;
    for (auto& [line, error] : errors_) {
      if (errors.size() == kMaxErrors) {
        errors.push_back({file_name_, fmt::format("{} more problems", errors_.size() - kMaxErrors), ""});
        break;
      }
      errors.push_back(std::move(error));
    }
    return errors;
  }

  // For use in a message, without the quotes.
  static std::string shortened(const std::string& text) {
    const std::string quotation = base::inQuotes(text);
    return quotation.substr(1, quotation.size() - 2);
  }

  std::string placeOf(int line) const {
    return line == 0 ? file_name_ : fmt::format("{}:{}", file_name_, line);
  }

  void report(int line, base::Error error) {
    error.where = error.where.empty() ? placeOf(line) : fmt::format("{}: {}", placeOf(line), error.where);
    errors_.emplace_back(line, std::move(error));
  }

  void takeAdditions(const YamlFile& file) {
    AdditionsRead read = additionsIn(file);
    for (PlacedAdditionError& error : read.errors) report(error.line, std::move(error.error.error));
    if (!read.errors.empty()) refused_.insert({"frames", "fixtures", "regions"});
    additions_ = std::move(read.lists);
    additions_.applyTo(settings_.additions);
  }

  // The lists are read by takeAdditions().
  void placeAdditions(const YamlGroup& group) {
    if (!with_additions_) {
      report(group.line,
             {group.name, "is not part of this file", "remove it; it belongs in hapticd.yaml or a profile"});
    }
    if (set_at_.emplace(group.name, Place{group.line, placeOf(group.line)}).second) ++addition_groups_;
  }

  void checkGroup(const YamlGroup& group) {
    if (isAdditionGroup(group.name)) return placeAdditions(group);
    const std::vector<std::string_view> names = groupNames();
    if (std::ranges::find(names, group.name) == names.end()) {
      if (leaves_out_unknown_ && !group.scalar) return;  // by name in takeEntry()
      unknown_groups_.insert(group.name);
      report(group.line, unknownGroup(group, names));
    } else if (group.scalar) {
      report(
          group.line,
          {group.name, fmt::format("found {} where `name: value` is expected", base::inQuotes(*group.scalar)),
           fmt::format("write it as `{}: {{name: value}}`", group.name)});
    }
  }

  void takeEntry(const YamlEntry& entry) {
    if (isAdditionGroup(entry.group)) {
      return report(entry.line, {entry.group, "is a mapping", "write the path of a PGM file"});
    }
    if (unknown_groups_.contains(entry.group)) return;
    const std::string name = entry.group + "." + entry.name;
    const Parameter* parameter = findParameter(name);
    if (parameter == nullptr && leaves_out_unknown_) {
      unknown_.push_back(name);
      return;
    }
    if (parameter == nullptr) {
      report(entry.line, unknownParameter(name));
      return;
    }
    if (belongs_ && !belongs_(*parameter)) {
      report(entry.line, {name, "is not a parameter of this file",
                          "remove the line; the parameter belongs in hapticd.yaml"});
      return;
    }
    const base::Result<Value> value = valueOf(entry, *parameter);
    if (!value) {
      report(entry.line, value.error());
      refused_.insert(name);
      return;
    }
    parameter->set(settings_, *value);
    assignments_.push_back({parameter, *value});
    set_at_[name] = {entry.line, placeOf(entry.line)};
  }

  static base::Result<Value> valueOf(const YamlEntry& entry, const Parameter& parameter) {
    const bool is_text = parameter.kind == Kind::text || parameter.kind == Kind::choice;
    base::Result<Value> value = parameter.parse(entry.value);
    if (!value || is_text || !entry.quoted || std::holds_alternative<std::string>(*value)) return value;
    return std::unexpected(
        base::Error{std::string(parameter.name),
                    fmt::format("{} is text because of its quotes; write {} without them (allowed: {})",
                                base::inQuotes(entry.value), shortened(entry.value), parameter.range()),
                    ""});
  }

  // A conflict is reported at the place of its first parameter that was set at all.
  std::pair<int, base::Error> placed(const Conflict& conflict) const {
    for (const std::string_view name : conflict.parameters) {
      const auto place = set_at_.find(std::string(name));
      if (place == set_at_.end()) continue;
      base::Error error = conflict.error;
      error.where = fmt::format("{}: {}", place->second.text, error.where);
      return {place->second.line, std::move(error)};
    }
    return {0, conflict.error};
  }

  std::string file_name_;
  std::function<bool(const Parameter&)> belongs_;
  Settings settings_;
  std::vector<Assignment> assignments_;
  bool with_additions_;  // the file may contain lists of SceneAdditions
  AdditionLists additions_;
  std::size_t addition_groups_ = 0;  // of those in set_at_
  bool complete_ = false;            // the file was read to its end
  bool any_group_ = false;
  std::vector<std::pair<int, base::Error>> errors_;  // with the line, for sorting
  std::map<std::string, Place> set_at_;
  std::set<std::string> refused_;
  std::set<std::string> unknown_groups_;
  bool leaves_out_unknown_ = false;
  std::vector<std::string> unknown_;  // left out
};

std::expected<Settings, std::vector<base::Error>> settingsOf(
    std::expected<Configuration, std::vector<base::Error>> configuration) {
  if (!configuration) return std::unexpected(std::move(configuration.error()));
  return std::move(configuration->settings);
}

}  // namespace

std::expected<Configuration, std::vector<base::Error>> loadConfiguration(
    const std::filesystem::path& file, std::span<const std::string> overrides, base::FileKind kind) {
  Loading loading(file.string());
  const auto content = base::fileContent(file, {.longest = kMaxFileBytes, .kind = kind});
  if (!content) return std::unexpected(std::vector{unreadable(file, content.error())});
  loading.take(*content);
  loading.requireGroup();
  for (const std::string& name_and_value : overrides) loading.takeOverride(name_and_value);
  loading.checkRules();
  auto configuration = std::move(loading).finish();
  if (configuration) configuration->has_marks = marksIn(*content).ended;
  return configuration;
}

std::expected<Settings, std::vector<base::Error>> loadSettings(const std::filesystem::path& file,
                                                               std::span<const std::string> overrides) {
  return settingsOf(loadConfiguration(file, overrides, base::FileKind::any));
}

std::expected<Settings, std::vector<base::Error>> settingsFromText(std::string_view text,
                                                                   const std::string& name) {
  Loading loading(name);
  loading.take(text);
  loading.checkRules();
  return settingsOf(std::move(loading).finish());
}

std::expected<RecordedSettings, std::vector<base::Error>> recordedSettings(std::string_view text,
                                                                           const std::string& name) {
  Loading loading(name);
  loading.leaveOutUnknown();
  loading.take(text);
  loading.checkRules();
  return std::move(loading).finishRecorded();
}

std::expected<std::vector<Assignment>, std::vector<base::Error>> assignmentsFromText(
    std::string_view text, const std::string& name, const std::function<bool(const Parameter&)>& belongs) {
  Loading loading(name, belongs, false);
  loading.take(text);
  auto part = std::move(loading).finishPart();
  if (!part) return std::unexpected(std::move(part.error()));
  return std::move(part->assignments);
}

std::expected<SettingsPart, std::vector<base::Error>> partFromText(
    std::string_view text, const std::string& name, const std::function<bool(const Parameter&)>& belongs) {
  Loading loading(name, belongs);
  loading.take(text);
  return std::move(loading).finishPart();
}

}  // namespace hapticd::config
