// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/additions/addition_reader.h"
#include "config/base/error.h"
#include "config/base/file_content.h"
#include "config/settings/parameter_table.h"
#include "config/settings/settings.h"

namespace hapticd::config {

/// Settings and statistics of how they were loaded.
struct Configuration {
  Settings settings;
  std::size_t parameters_set = 0;  ///< number set by the file and the overrides, each counted once
  /// Whether the file has the marks of its beginning and end, without which nothing shows that it was cut.
  bool has_marks = false;
};

/// Loads settings from a YAML 1.2 file of the form `group: {name: value}`, at most 1 MiB, which may also
/// contain the lists of SceneAdditions, and then applies `overrides` of the form "group.name=value"; all
/// other parameters keep their defaults. Numbers and truth values are written without quotes; anchors,
/// aliases, tags and multiple documents are not supported. Errors: every problem of the file, each with file,
/// line, value and allowed range; nothing is applied partially. A file without any group is one, as is one
/// that begins with a line `---` and does not end with a line `...`: what was cut must not count as a
/// request for the defaults.
std::expected<Configuration, std::vector<base::Error>> loadConfiguration(
    const std::filesystem::path& file, std::span<const std::string> overrides, base::FileKind kind);

/// Loads only the settings, from a file of any kind.
std::expected<Settings, std::vector<base::Error>> loadSettings(const std::filesystem::path& file,
                                                               std::span<const std::string> overrides = {});

/// Loads settings from `text`, which messages call `name`.
std::expected<Settings, std::vector<base::Error>> settingsFromText(std::string_view text,
                                                                   const std::string& name);

/// The settings that were recorded with something, and the names in them that are no parameters of this
/// version, which are left out.
struct RecordedSettings {
  Settings settings;
  std::vector<std::string> unknown;
};
std::expected<RecordedSettings, std::vector<base::Error>> recordedSettings(std::string_view text,
                                                                           const std::string& name);

/// A parameter of the table and a valid value for it.
struct Assignment {
  const Parameter* parameter = nullptr;
  Value value;
};

/// Parses the assignments in a text of the same form, in order, to be applied to other settings; the caller
/// must then check the rules between parameters (checkTogether). Messages call the text `name`. `belongs`:
/// whether a parameter is allowed there.
/// Errors: those of a configuration file, and parameters that are not allowed there, as the lists of
/// SceneAdditions.
std::expected<std::vector<Assignment>, std::vector<base::Error>> assignmentsFromText(
    std::string_view text, const std::string& name, const std::function<bool(const Parameter&)>& belongs);

/// A part of a configuration: parameters, and lists of SceneAdditions.
struct SettingsPart {
  std::vector<Assignment> assignments;
  AdditionLists additions;
};

/// The same for a text that may also contain the lists of SceneAdditions.
std::expected<SettingsPart, std::vector<base::Error>> partFromText(
    std::string_view text, const std::string& name, const std::function<bool(const Parameter&)>& belongs);

}  // namespace hapticd::config
