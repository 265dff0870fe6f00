// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/file_content.h"
#include "config/parameter_table.h"
#include "config/settings.h"

namespace hapticd::config {

/// Settings, and how they came about.
struct Configuration {
  Settings settings;
  std::size_t parameters_set = 0;  ///< by the file and the overrides; each once
};

/// Settings from a YAML 1.2 file of the form `group: {name: value}`, at most 1 MiB, and from `overrides` of
/// the form "group.name=value", which are applied after it; what neither names keeps its default. An empty
/// file is valid. Numbers and truth values stand without quotes; no anchors, aliases, tags or second
/// documents. Errors: every problem of the file, each with file, line, value and allowed range; nothing is
/// half applied.
std::expected<Configuration, std::vector<Error>> loadConfiguration(const std::filesystem::path& file,
                                                                   std::span<const std::string> overrides,
                                                                   FileKind kind);

/// The settings alone, from a file of any kind.
std::expected<Settings, std::vector<Error>> loadSettings(const std::filesystem::path& file,
                                                         std::span<const std::string> overrides = {});

/// The same of `text`, which messages call `name`.
std::expected<Settings, std::vector<Error>> settingsFromText(std::string_view text, const std::string& name);

/// A parameter of the table and a value that it takes.
struct Assignment {
  const Parameter* parameter = nullptr;
  Value value;
};

/// What a text of the same form sets, in its order, to be set on top of other settings: the rules between
/// parameters (checkTogether) are the caller's to check then. Messages call it `name`. `belongs`: whether a
/// parameter may be there. Errors: those of a file of settings, and parameters that do not belong there.
std::expected<std::vector<Assignment>, std::vector<Error>> assignmentsFromText(
    std::string_view text, const std::string& name, const std::function<bool(const Parameter&)>& belongs);

}  // namespace hapticd::config
