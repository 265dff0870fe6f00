// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
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

}  // namespace hapticd::config
