// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/client/reply_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace hapticd::tools {

const Json* fieldAt(const Json& json, std::string_view path) {
  const Json* place = &json;
  while (!path.empty()) {
    const std::size_t dot = path.find('.');
    const std::string name(path.substr(0, dot));
    if (!place->is_object()) return nullptr;
    const auto found = place->find(name);
    if (found == place->end()) return nullptr;
    place = &*found;
    path.remove_prefix(dot == std::string_view::npos ? path.size() : dot + 1);
  }
  return place;
}

double numberAt(const Json& json, std::string_view path) {
  const Json* field = fieldAt(json, path);
  return field && field->is_number() ? field->get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::string textAt(const Json& json, std::string_view path) {
  const Json* field = fieldAt(json, path);
  return field && field->is_string() ? printable(field->get<std::string>()) : "-";
}

bool flagAt(const Json& json, std::string_view path) {
  const Json* field = fieldAt(json, path);
  return field && field->is_boolean() && field->get<bool>();
}

const Json& listAt(const Json& json, std::string_view path) {
  static const Json empty = Json::array();
  const Json* field = fieldAt(json, path);
  return field && field->is_array() ? *field : empty;
}

std::string namesText(const Json& json, std::string_view path) {
  std::string text;
  for (const Json& named : listAt(json, path)) text += textAt(named, "name") + "\n";
  return text;
}

std::string countAt(const Json& json, std::string_view path) {
  return fixed(numberAt(json, path), 0);
}

double lengthAt(const Json& json, std::string_view path) {
  const std::string base(path);
  return std::hypot(numberAt(json, base + ".x"), numberAt(json, base + ".y"), numberAt(json, base + ".z"));
}

std::string fixed(double value, int digits) {
  return std::isnan(value) ? "-" : fmt::format("{:.{}f}", value, digits);
}

std::string duration(double nanoseconds) {
  if (std::isnan(nanoseconds)) return "-";
  if (nanoseconds < 1e3) return fmt::format("{:.0f} ns", nanoseconds);
  if (nanoseconds < 1e6) return fmt::format("{:.1f} us", nanoseconds / 1e3);
  if (nanoseconds < 1e9) return fmt::format("{:.2f} ms", nanoseconds / 1e6);
  return fmt::format("{:.2f} s", nanoseconds / 1e9);
}

std::string valueText(const Json& value) {
  if (value.is_string()) return printable(value.get<std::string>());
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());  // shortest that reads back
  return value.dump();
}

}  // namespace hapticd::tools
