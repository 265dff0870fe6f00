#pragma once

#include <expected>
#include <filesystem>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/settings.h"

namespace hapticd::config {

/// Settings from a YAML file of the form `group: {name: value}`; what the file does not name keeps its default.
/// Errors: every problem of the file, each with file, line, value and allowed range; nothing is half applied.
std::expected<Settings, std::vector<Error>> loadSettings(const std::filesystem::path& file,
                                                         std::span<const std::string> overrides = {});

}  // namespace hapticd::config
