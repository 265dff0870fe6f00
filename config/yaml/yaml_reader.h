// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::config {

/// A problem in a line of a YAML text; line 0: of the text as a whole.
struct YamlProblem {
  int line = 0;
  std::string where;  ///< "group.name" or "group"; may be empty
  std::string what;
  std::string remedy;
};

struct YamlMember;

/// A value of any form, of a YAML text or of a call.
struct YamlNode {
  enum class Type {
    null,     ///< nothing is written
    scalar,   ///< `text`
    list,     ///< `items`
    map,      ///< `members`, duplicates included
    refused,  ///< an element of YAML that is not supported and has been reported
  };

  Type type = Type::null;
  int line = 0;  ///< 1 for the first
  std::string text;
  bool quoted = false;
  std::vector<YamlNode> items;
  std::vector<YamlMember> members;

  /// Returns the first member of this name, or null.
  const YamlMember* find(std::string_view name) const;
};

/// One `name: value` of a mapping.
struct YamlMember {
  std::string name;  ///< empty if it is no scalar
  YamlNode::Type name_type = YamlNode::Type::scalar;
  int line = 0;  ///< of the name
  YamlNode value;
};

inline const YamlMember* YamlNode::find(std::string_view name) const {
  const auto found = std::ranges::find(members, name, &YamlMember::name);
  return found == members.end() ? nullptr : &*found;
}

/// A name or a value as read by the parser.
struct SourceScalar {
  std::size_t at = 0;  ///< offset of its first byte, including its quote if it has one
  std::string value;
  bool name = false;     ///< a colon must follow
  bool in_list = false;  ///< the punctuation of lists may be beside it
};

/// Compares a text with the parser's `scalars`, in order. yaml-cpp silently skips what it cannot interpret,
/// and quoted text may extend over lines; in both cases names would vanish. Therefore each scalar must be on
/// one line, as its value indicates, followed by a colon if it is a name, and only blanks, comments and the
/// punctuation of maps (and of lists, beside scalars of lists) may be between them. Returns the first place
/// that violates this. `complete`: the parser has reached the end of the text; otherwise, what follows the
/// last scalar is not checked.
std::optional<YamlProblem> sourceProblem(std::string_view text, std::span<const SourceScalar> scalars,
                                         bool complete);

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
