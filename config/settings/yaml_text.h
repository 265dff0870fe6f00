// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "config/settings/parameter_table.h"
#include "config/settings/settings.h"

namespace hapticd::config {

/// Returns a double-quoted scalar of YAML 1.2, which can hold any text.
std::string quotedText(const std::string& text);
/// The same of a value that is text; any other one as toText().
std::string quotedText(const Value& value);

/// Returns the parameters selected by `chosen` (all if it is empty) as a file that loadSettings() reads back
/// to the same values.
std::string yamlText(const Settings& settings, const std::function<bool(const Parameter&)>& chosen = {});

/// Adds the marks of the beginning and the end, so that a reader refuses a text whose end was cut off.
inline std::string withMarks(const std::string& text) {
  return "---\n" + text + "...\n";
}

}  // namespace hapticd::config
