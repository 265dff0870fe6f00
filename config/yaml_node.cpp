// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_node.h"

#include <algorithm>
#include <utility>

namespace hapticd::config {

const YamlMember* YamlNode::find(std::string_view name) const {
  const auto found = std::ranges::find(members, name, &YamlMember::name);
  return found == members.end() ? nullptr : &*found;
}

bool YamlNodeBuilder::expectsName() const {
  return !open_.empty() && open_.back().node.type == YamlNode::Type::map && !open_.back().name;
}

bool YamlNodeBuilder::takeScalar(std::string_view text, bool quoted, int line) {
  YamlNode node = nodeOf(YamlNode::Type::scalar, line);
  node.text = text;
  node.quoted = quoted;
  return attach(std::move(node));
}

void YamlNodeBuilder::enter(int line, bool map) {
  open_.push_back({nodeOf(map ? YamlNode::Type::map : YamlNode::Type::list, line), std::nullopt});
}

YamlNode YamlNodeBuilder::nodeOf(YamlNode::Type type, int line) {
  YamlNode node;
  node.type = type;
  node.line = line;
  return node;
}

bool YamlNodeBuilder::leave() {
  YamlNode node = std::move(open_.back().node);
  open_.pop_back();
  return attach(std::move(node));
}

YamlNode YamlNodeBuilder::take() {
  while (!open_.empty()) leave();
  return std::move(root_);
}

bool YamlNodeBuilder::attach(YamlNode node) {
  if (open_.empty()) {
    root_ = std::move(node);
    return true;
  }
  auto& [parent, name] = open_.back();
  if (parent.type == YamlNode::Type::list) {
    if (++parent.count <= YamlNode::kMaxStored) parent.items.push_back(std::move(node));
  } else if (!name) {
    // a name that is not a scalar is kept empty: no member has it
    name = Name{std::move(node.text), node.line};
  } else {
    if (++parent.count <= YamlNode::kMaxStored) {
      parent.members.push_back({std::move(name->text), name->line, std::move(node)});
    }
    name.reset();
  }
  return false;
}

}  // namespace hapticd::config
