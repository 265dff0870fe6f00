// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "config/yaml_node.h"

namespace hapticd::config {

/// Finds everything that must not occur in a YAML file, at most one find per line: bytes that are not UTF-8,
/// control characters, and tabs in the indentation.
std::vector<YamlProblem> forbiddenBytesIn(std::string_view text);

}  // namespace hapticd::config
