// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <map>
#include <string>
#include <string_view>

namespace hapticd::test {

/// The values of a file of the form `group: {name: value}` by "group.name", as libyaml's parser sees them, or
/// why it refuses the text. A second reader of the same format that shares no code with the one under test.
/// Errors: also what is YAML but not of that form, and a group or a name given twice.
std::expected<std::map<std::string, std::string>, std::string> valuesByLibyaml(std::string_view text);

}  // namespace hapticd::test
