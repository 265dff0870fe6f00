// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/type_hash.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "config/base/sha256.h"
#include "tools/lib/ros/message_definitions.h"

namespace hapticd::tools::ros {
namespace {

/// Numbers of types as type_description_interfaces/msg/FieldType counts them; char is an alias of uint8.
struct TypeNumber {
  std::string_view type;
  int number;
};
constexpr int kMessage = 1;
constexpr int kBoundedString = 21;
/// To be added to the number of the elements.
constexpr int kArray = 48;
constexpr int kListOfAnyLength = 144;
constexpr std::array kTypeNumbers{
    TypeNumber{"int8", 2},     TypeNumber{"uint8", 3},    TypeNumber{"int16", 4}, TypeNumber{"uint16", 5},
    TypeNumber{"int32", 6},    TypeNumber{"uint32", 7},   TypeNumber{"int64", 8}, TypeNumber{"uint64", 9},
    TypeNumber{"float32", 10}, TypeNumber{"float64", 11}, TypeNumber{"char", 3},  TypeNumber{"bool", 15},
    TypeNumber{"byte", 16},    TypeNumber{"string", 17}};

int numberOfElement(const MessageField& field) {
  if (field.type.contains('/')) return kMessage;
  if (field.longest_text > 0) return kBoundedString;
  const auto found = std::ranges::find(kTypeNumbers, field.type, &TypeNumber::type);
  if (found == kTypeNumbers.end()) throw std::logic_error(fmt::format("no type is called {}", field.type));
  return found->number;
}

int numberOf(const MessageField& field) {
  const int list = field.is_list ? kListOfAnyLength : 0;
  return numberOfElement(field) + (field.elements > 0 ? kArray : list);
}

std::string fieldDescription(const MessageField& field) {
  return fmt::format(
      R"({{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
      field.name, numberOf(field), field.elements, field.longest_text,
      field.type.contains('/') ? fullTypeName(field.type) : "");
}

std::string messageDescription(std::string_view name) {
  std::string fields;
  for (const MessageField& field : fieldsOf(messageDefinition(name)))
    fields += (fields.empty() ? "" : ", ") + fieldDescription(field);
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", fullTypeName(name), fields);
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
