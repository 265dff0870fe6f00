// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/messages/type_hash.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "config/base/sha256.h"
#include "tools/hapticd-ros/messages/message_definitions.h"

namespace hapticd::tools::ros {
namespace {

/// Numbers of types as type_description_interfaces/msg/FieldType counts them.
struct TypeNumber {
  std::string_view type;
  int number;
};
constexpr int kMessage = 1;
constexpr int kListOfAnyLength = 144;  ///< to be added to the number of the elements
constexpr std::array kTypeNumbers{
    TypeNumber{"int8", 2},     TypeNumber{"uint8", 3},    TypeNumber{"int16", 4}, TypeNumber{"uint16", 5},
    TypeNumber{"int32", 6},    TypeNumber{"uint32", 7},   TypeNumber{"int64", 8}, TypeNumber{"uint64", 9},
    TypeNumber{"float32", 10}, TypeNumber{"float64", 11}, TypeNumber{"bool", 15}, TypeNumber{"byte", 16},
    TypeNumber{"string", 17}};

int numberOf(std::string_view type) {
  if (type.contains('/')) return kMessage;
  const auto found = std::ranges::find(kTypeNumbers, type, &TypeNumber::type);
  if (found == kTypeNumbers.end()) throw std::logic_error(fmt::format("no type is called {}", type));
  return found->number;
}

/// "geometry_msgs/Point" as "geometry_msgs/msg/Point"; empty for types of the language.
std::string fullName(std::string_view type) {
  const std::size_t slash = type.find('/');
  if (slash == type.npos) return "";
  return fmt::format("{}/msg/{}", type.substr(0, slash), type.substr(slash + 1));
}

std::string fieldDescription(const MessageField& field) {
  return fmt::format(
      R"({{"name": "{}", "type": {{"type_id": {}, "capacity": 0, "string_capacity": 0, "nested_type_name": "{}"}}}})",
      field.name, numberOf(field.type) + (field.is_list ? kListOfAnyLength : 0), fullName(field.type));
}

std::string messageDescription(std::string_view name) {
  std::string fields;
  for (const MessageField& field : fieldsOf(messageDefinition(name)))
    fields += (fields.empty() ? "" : ", ") + fieldDescription(field);
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", fullName(name), fields);
}

}  // namespace

std::string typeHash(std::string_view name) {
  std::string inside;
  for (const std::string_view message : messagesInside(name))
    inside += (inside.empty() ? "" : ", ") + messageDescription(message);
  return "RIHS01_" +
         base::sha256(fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                                  messageDescription(name), inside));
}

}  // namespace hapticd::tools::ros
