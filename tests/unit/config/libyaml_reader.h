// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <map>
#include <string>
#include <string_view>

namespace hapticd::test {

/// Returns the values of a file of the form `group: {name: value}` by "group.name" as seen by libyaml's
/// parser, or why it refuses the text. A second reader of the same format that shares no code with the one
/// under test.
/// Errors: also YAML of another form, and a duplicate group or name.
std::expected<std::map<std::string, std::string>, std::string> valuesByLibyaml(std::string_view text);

}  // namespace hapticd::test
