// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/config/libyaml_reader.h"

#include <fmt/format.h>
#include <yaml.h>

#include <optional>
#include <vector>

namespace hapticd::test {
namespace {

using Values = std::map<std::string, std::string>;

/// A document as composed by libyaml.
class Document {
 public:
  explicit Document(yaml_parser_t& parser) { loaded_ = yaml_parser_load(&parser, &document_) != 0; }
  ~Document() {
    if (loaded_) yaml_document_delete(&document_);
  }
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  bool loaded() const { return loaded_; }
  /// Returns null at the end of the stream.
  yaml_node_t* root() { return yaml_document_get_root_node(&document_); }
  yaml_node_t* node(int index) { return yaml_document_get_node(&document_, index); }

 private:
  yaml_document_t document_{};
  bool loaded_ = false;
};

std::string textOf(const yaml_node_t& node) {
  return {reinterpret_cast<const char*>(node.data.scalar.value), node.data.scalar.length};
}

bool isNull(const yaml_node_t& node) {
  return node.type == YAML_SCALAR_NODE && node.data.scalar.style == YAML_PLAIN_SCALAR_STYLE &&
         (node.data.scalar.length == 0 || textOf(node) == "~" || textOf(node) == "null");
}

using Entries = std::vector<std::pair<std::string, yaml_node_t*>>;

/// Returns the entries of a map with scalar keys; nothing for any other node.
std::optional<Entries> entriesOf(Document& document, const yaml_node_t& map) {
  if (map.type != YAML_MAPPING_NODE) return std::nullopt;
  Entries entries;
  for (auto* pair = map.data.mapping.pairs.start; pair != map.data.mapping.pairs.top; ++pair) {
    const yaml_node_t& key = *document.node(pair->key);
    if (key.type != YAML_SCALAR_NODE) return std::nullopt;
    entries.emplace_back(textOf(key), document.node(pair->value));
  }
  return entries;
}

std::expected<Values, std::string> valuesOf(Document& document) {
  Values values;
  yaml_node_t* const root = document.root();
  if (root == nullptr || isNull(*root)) return values;
  const auto groups = entriesOf(document, *root);
  if (!groups) return std::unexpected("the root is no map of names");
  std::map<std::string, int> seen;
  for (const auto& [group, node] : *groups) {
    if (++seen[group] > 1) return std::unexpected("the group " + group + " is given twice");
    if (isNull(*node)) continue;
    const auto entries = entriesOf(document, *node);
    if (!entries) return std::unexpected("the group " + group + " is no map of names");
    for (const auto& [name, value] : *entries) {
      if (value->type != YAML_SCALAR_NODE) return std::unexpected(group + "." + name + " is no scalar");
      if (!values.emplace(group + "." + name, textOf(*value)).second) {
        return std::unexpected(group + "." + name + " is given twice");
      }
    }
  }
  return values;
}

std::expected<Values, std::string> valuesOf(yaml_parser_t& parser) {
  const auto failure = [&parser] {
    return std::unexpected(fmt::format("line {}: {}", parser.problem_mark.line + 1,
                                       parser.problem != nullptr ? parser.problem : "no memory"));
  };
  Document document(parser);
  if (!document.loaded()) return failure();
  auto values = valuesOf(document);
  if (!values || document.root() == nullptr) return values;
  Document second(parser);
  if (!second.loaded()) return failure();
  if (second.root() != nullptr) return std::unexpected("a second document follows");
  return values;
}

}  // namespace

std::expected<Values, std::string> valuesByLibyaml(std::string_view text) {
  yaml_parser_t parser;
  if (yaml_parser_initialize(&parser) == 0) return std::unexpected("no memory");
  yaml_parser_set_input_string(&parser, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  auto values = valuesOf(parser);
  yaml_parser_delete(&parser);
  return values;
}

}  // namespace hapticd::test
