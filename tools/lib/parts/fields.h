// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <bit>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

/// Results as JSON that reads back to the same bits. A structure takes part by a function template fieldsOf()
/// beside it, which names all its members in a structured binding and returns std::tie() of those that are
/// kept: a member more or less then no longer compiles.
namespace hapticd::tools {

/// `Type` is `Wanted`, const or not. What a fieldsOf() takes.
template <typename Type, typename Wanted>
concept Is = std::same_as<std::remove_const_t<Type>, Wanted>;

template <typename Type>
concept HasFields = requires(Type& value) {
  fieldsOf(value);
};

/// JSON's numbers are those of a double, shortest form, except for infinities and NaN, which become their
/// bits as a string.
inline nlohmann::json toFields(double number) {
  if (std::isfinite(number)) return number;
  return fmt::format("{:#018x}", std::bit_cast<std::uint64_t>(number));
}
template <typename Type>
nlohmann::json toFields(const Type& value) {
  return value;  // whole numbers, words, enumerations, and containers of those
}
template <typename Type>
nlohmann::json toFields(const std::optional<Type>& value);
template <typename Type>
nlohmann::json toFields(const std::vector<Type>& values);
template <HasFields Type>
nlohmann::json toFields(const Type& value);

template <typename Type>
nlohmann::json toFields(const std::optional<Type>& value) {
  return value ? toFields(*value) : nlohmann::json();
}
template <typename Type>
nlohmann::json toFields(const std::vector<Type>& values) {
  nlohmann::json list = nlohmann::json::array();
  for (const Type& value : values) list.push_back(toFields(value));
  return list;
}
template <HasFields Type>
nlohmann::json toFields(const Type& value) {
  nlohmann::json list = nlohmann::json::array();
  std::apply([&list](const auto&... fields) { (list.push_back(toFields(fields)), ...); }, fieldsOf(value));
  return list;
}

/// The inverse of toFields().  Throws an exception of nlohmann::json or std::invalid_argument on what it has
/// not written.
inline void fromFields(const nlohmann::json& json, double& number) {
  if (!json.is_string()) {
    json.get_to(number);
    return;
  }
  const auto& text = json.get_ref<const std::string&>();
  constexpr std::size_t kPrefix = 2;
  std::uint64_t bits = 0;
  const char* const end = text.data() + text.size();
  const bool is_read =
      text.starts_with("0x") && std::from_chars(text.data() + kPrefix, end, bits, 16).ptr == end;
  if (!is_read) throw std::invalid_argument(json.dump() + " is not a number");
  number = std::bit_cast<double>(bits);
}
template <typename Type>
void fromFields(const nlohmann::json& json, Type& value) {
  json.get_to(value);
}
template <typename Type>
void fromFields(const nlohmann::json& json, std::optional<Type>& value);
template <typename Type>
void fromFields(const nlohmann::json& json, std::vector<Type>& values);
template <HasFields Type>
void fromFields(const nlohmann::json& json, Type& value);

template <typename Type>
void fromFields(const nlohmann::json& json, std::optional<Type>& value) {
  value.reset();
  if (!json.is_null()) fromFields(json, value.emplace());
}
template <typename Type>
void fromFields(const nlohmann::json& json, std::vector<Type>& values) {
  values.clear();
  for (const nlohmann::json& element : json) fromFields(element, values.emplace_back());
}
template <HasFields Type>
void fromFields(const nlohmann::json& json, Type& value) {
  const auto fields = fieldsOf(value);
  if (!json.is_array() || json.size() != std::tuple_size_v<decltype(fields)>) {
    throw std::invalid_argument("a result has other fields");
  }
  std::size_t place = 0;
  std::apply([&](auto&... field) { (fromFields(json[place++], field), ...); }, fields);
}

}  // namespace hapticd::tools
