// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::config {

struct YamlMember;

/// A value of any form in a YAML text.
struct YamlNode {
  enum class Type {
    null,     ///< nothing is written
    scalar,   ///< `text`
    list,     ///< `items`
    map,      ///< `members`, duplicates included
    refused,  ///< an element of YAML that is not supported and has been reported
  };
  /// More items or members of one node are counted but not stored, to bound the memory for unrelated files.
  static constexpr std::size_t kMaxStored = 300;

  Type type = Type::null;
  int line = 0;  ///< 1 for the first
  std::string text;
  bool quoted = false;
  std::vector<YamlNode> items;
  std::vector<YamlMember> members;
  std::size_t count = 0;  ///< number of items or members, including those that are not stored

  /// Returns the first member of this name, or null.
  const YamlMember* find(std::string_view name) const;
};

/// One `name: value` of a mapping.
struct YamlMember {
  std::string name;
  int line = 0;
  YamlNode value;
};

/// Builds a node from the events of a parser, in their order.
class YamlNodeBuilder {
 public:
  /// Whether a scalar would be the name of a member.
  bool expectsName() const;
  /// Each takes the next event. Returns true when the node is complete.
  bool takeScalar(std::string_view text, bool quoted, int line);
  bool takeNull(int line) { return attach(nodeOf(YamlNode::Type::null, line)); }
  bool takeRefused(int line) { return attach(nodeOf(YamlNode::Type::refused, line)); }
  void enter(int line, bool map);
  bool leave();

  /// Returns the node; if it is not complete, what has been read of it.
  YamlNode take();

 private:
  struct Name {
    std::string text;
    int line = 0;
  };
  struct Level {
    YamlNode node;
    std::optional<Name> name;  ///< of the member whose value is expected
  };

  static YamlNode nodeOf(YamlNode::Type type, int line);
  bool attach(YamlNode node);

  std::vector<Level> open_;
  YamlNode root_;
};

}  // namespace hapticd::config
