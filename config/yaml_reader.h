// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::config {

/// One `name: value` of a file of the form `group: {name: value}`.
struct YamlEntry {
  std::string group;
  std::string name;
  std::string value;
  bool quoted = false;  ///< the value stood in quotes
  int line = 0;         ///< of the name, 1 for the first
};

struct YamlGroup {
  std::string name;
  int line = 0;
  std::optional<std::string> scalar;  ///< what stood where the group's entries belong: `group: scalar`
};

/// What is wrong in which line; line 0: with the file as a whole.
struct YamlProblem {
  int line = 0;
  std::string where;  ///< "group.name" or "group"; may be empty
  std::string what;
  std::string remedy;
};

struct YamlFile {
  std::vector<YamlGroup> groups;   ///< each once, empty ones too
  std::vector<YamlEntry> entries;  ///< each once
  std::vector<YamlProblem> problems;
  bool complete = false;  ///< read to the end; false after what no parser can get over
};

/// Reads the form `group: {name: value}` without any knowledge of the names: everything of YAML that is not
/// this form, and every group or name given twice, is a problem.
YamlFile readYaml(std::string_view text);

}  // namespace hapticd::config
