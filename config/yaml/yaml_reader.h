// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/yaml/yaml_node.h"

namespace hapticd::config {

/// One `name: value` of a file of the form `group: {name: value}`.
struct YamlEntry {
  std::string group;
  std::string name;
  std::string value;
  bool quoted = false;  ///< the value was in quotes
  int line = 0;         ///< of the name, 1 for the first
};

/// One group of a file.
struct YamlGroup {
  std::string name;
  int line = 0;
  std::optional<std::string> scalar;  ///< scalar in place of the group's entries: `group: scalar`
};

/// One group whose value is a list of mappings, for example `fixtures: [{name: nerve}]`.
struct YamlList {
  std::string name;
  YamlNode node;  ///< a list, or whatever is written in its place
};

/// Content of a file.
struct YamlFile {
  std::vector<YamlGroup> groups;   ///< each once, including empty ones
  std::vector<YamlEntry> entries;  ///< each once
  std::vector<YamlList> lists;     ///< each at its first occurrence; their names are also in `groups`
  std::vector<YamlProblem> problems;
  bool complete = false;  ///< read to the end; false after an error from which no parser can recover
};

/// Reads the form `group: {name: value}` without knowledge of the names, except those of the groups that are
/// lists: any other element of YAML, and every duplicate group or name, is a problem. Within the lists, the
/// reader of the nodes finds duplicates and unsuitable forms.
YamlFile readYaml(std::string_view text);

}  // namespace hapticd::config
