// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "config/additions/addition_fields.h"
#include "config/yaml/yaml_reader.h"

/// Fixtures and regions as JSON of a call or reply. `Json` is nlohmann::json or nlohmann::ordered_json, which
/// this room itself does not use.
namespace hapticd::config {

/// Returns a JSON value as the tree that definitionsFrom() and changed() read; all of it is in line 1.
template <typename Json>
YamlNode nodeOf(const Json& json) {
  YamlNode node;
  node.line = 1;
  if (json.is_object()) {
    node.type = YamlNode::Type::map;
    for (auto member = json.begin(); member != json.end(); ++member)
      node.members.push_back({member.key(), YamlNode::Type::scalar, 1, nodeOf(member.value())});
  } else if (json.is_array()) {
    node.type = YamlNode::Type::list;
    for (const Json& item : json) node.items.push_back(nodeOf(item));
  } else if (!json.is_null()) {
    node.type = YamlNode::Type::scalar;
    node.quoted = json.is_string();
    node.text = node.quoted ? json.template get<std::string>() : json.dump();
  }
  return node;
}

/// Returns a value as JSON. Whole numbers have no decimal point.
template <typename Json>
Json jsonOf(const Value& value) {
  const auto number = [](double held) {
    constexpr double kMaxWhole = 9007199254740992;  // 2^53: a double holds all whole numbers up to here
    const bool whole = held == std::trunc(held) && std::abs(held) <= kMaxWhole;
    return whole ? Json(static_cast<std::int64_t>(held)) : Json(held);
  };
  const auto vector = [&number](const rt::Vec3& held) {
    return Json::array({number(held.x), number(held.y), number(held.z)});
  };
  return std::visit(
      [&]<typename Held>(const Held& held) {
        if constexpr (std::is_same_v<Held, double>) {
          return number(held);
        } else if constexpr (std::is_same_v<Held, rt::Vec3>) {
          return vector(held);
        } else if constexpr (std::is_same_v<Held, std::vector<rt::Vec3>>) {
          Json points = Json::array();
          for (const rt::Vec3& point : held) points.push_back(vector(point));
          return points;
        } else {
          return Json(held);
        }
      },
      value);
}

/// Returns the definition of a fixture, region or frame, which reads back as the same: the members that it
/// has.
template <typename Json>
Json definitionOf(const Addition& item) {
  Json definition = Json::object();
  for (const AdditionField& field : item.fields()) {
    if (item.writes(field)) definition[std::string(field.name)] = jsonOf<Json>(item.get(field));
  }
  return definition;
}

}  // namespace hapticd::config
