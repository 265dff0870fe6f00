#pragma once

#include <expected>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/parameter_table.h"
#include "config/settings.h"

namespace hapticd::config {

/// Settings from a YAML 1.2 file of the form `group: {name: value}`, at most 1 MiB, and from `overrides` of
/// the form "group.name=value", which are applied after it; what neither names keeps its default. An empty
/// file is valid. Numbers and truth values stand without quotes; no anchors, aliases, tags or second
/// documents. Errors: every problem of the file, each with file, line, value and allowed range; nothing is
/// half applied.
std::expected<Settings, std::vector<Error>> loadSettings(const std::filesystem::path& file,
                                                         std::span<const std::string> overrides = {});

/// The same of `text`, which messages call `name`.
std::expected<Settings, std::vector<Error>> settingsFromText(std::string_view text, const std::string& name);

/// A parameter of the table and a value that it takes.
struct Assignment {
  const Parameter* parameter = nullptr;
  Value value;
};

/// What a file of the same form sets, in its order, to be set on top of other settings: the rules between
/// parameters (checkTogether) are the caller's to check then. `belongs`: whether a parameter may be in the
/// file. Errors: those of a file of settings, and parameters that do not belong into it.
std::expected<std::vector<Assignment>, std::vector<Error>> loadAssignments(
    const std::filesystem::path& file, const std::function<bool(const Parameter&)>& belongs);

}  // namespace hapticd::config
