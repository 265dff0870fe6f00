// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
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

/// The value of a member as JSON; null for one that is only read. Whole numbers have no decimal point.
template <typename Json, typename Owner>
struct MemberJson {
  const Owner& owner;

  static Json of(double number) {
    constexpr double kMaxWhole = 9007199254740992;  // 2^53: a double holds all whole numbers up to here
    if (number == std::trunc(number) && std::abs(number) <= kMaxWhole)
      return Json(static_cast<std::int64_t>(number));
    return Json(number);
  }
  static Json of(const rt::Vec3& vector) { return Json::array({of(vector.x), of(vector.y), of(vector.z)}); }

  Json operator()(double Owner::*member) const { return of(owner.*member); }
  Json operator()(std::vector<rt::Vec3> Owner::*member) const {
    Json points = Json::array();
    for (const rt::Vec3& point : owner.*member) points.push_back(of(point));
    return points;
  }
  Json operator()(const WordMember<Owner>& member) const {
    return Json(std::string(member.words[member.get(owner)]));
  }
  Json operator()(const VectorMember<Owner>& member) const { return of(owner.*member.member); }
  Json operator()(const QuaternionMember<Owner>&) const { return Json(); }
  Json operator()(auto Owner::*member) const { return Json(owner.*member); }
};

/// Returns the definition of a fixture or region, which reads back as the same: the members that it has.
template <typename Json, typename Owner>
Json definitionOf(const Owner& owner) {
  Json definition = Json::object();
  for (const AdditionField<Owner>& field : fieldsOf(owner)) {
    if (!isWritten(field, owner)) continue;
    definition[std::string(field.name)] = std::visit(MemberJson<Json, Owner>{owner}, field.member);
  }
  return definition;
}

}  // namespace hapticd::config
