// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/format/message_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "config/base/value_text.h"

namespace hapticd::trace {
namespace {

using Field = MessageLayout::Field;
using Form = MessageLayout::Form;

struct NumberType {
  std::string_view name;
  std::size_t bytes;
};
constexpr std::array<NumberType, 11> kNumberTypes{{{"bool", 1},
                                                   {"int8", 1},
                                                   {"uint8", 1},
                                                   {"int16", 2},
                                                   {"uint16", 2},
                                                   {"int32", 4},
                                                   {"uint32", 4},
                                                   {"float32", 4},
                                                   {"int64", 8},
                                                   {"uint64", 8},
                                                   {"float64", 8}}};

/// No array of a trace has more elements.
constexpr std::size_t kMaxNumbers = 4096;
/// Constants are values of one byte.
constexpr std::size_t kMaxConstants = 256;
/// No message of a trace has more fields, by far: each costs time in every message.
constexpr std::size_t kMaxFields = 1000;

std::optional<std::size_t> numberIn(std::string_view text) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

/// Parses e.g. "float64" or "float64[3]".
bool setNumbers(std::string_view type, Field& field) {
  const std::size_t bracket = type.find('[');
  const auto* const found = std::ranges::find(kNumberTypes, type.substr(0, bracket), &NumberType::name);
  if (found == kNumberTypes.end()) return false;
  field.bytes = found->bytes;
  if (bracket == std::string_view::npos) return true;
  if (!type.ends_with(']')) return false;
  const auto count = numberIn(type.substr(bracket + 1, type.size() - bracket - 2));
  field.count = count.value_or(0);
  return count && *count <= kMaxNumbers;
}

bool setForm(std::string_view type, Field& field) {
  if (type == "string") return field.form = Form::text, true;
  if (type == "uint8[]") return field.form = Form::bytes, true;
  if (type == "hapticd_msgs/NamedText[]") return field.form = Form::named_texts, true;
  if (type == "builtin_interfaces/Time") return field.form = Form::time, true;
  return setNumbers(type, field);
}

/// Adds "NAME=VALUE" to the constants of the following field.
bool addConstant(std::string_view text, std::vector<std::pair<std::uint8_t, std::string>>& constants) {
  const std::size_t equals = text.find('=');
  const auto value = numberIn(text.substr(equals + 1));
  if (!value || *value >= kMaxConstants) return false;
  constants.emplace_back(static_cast<std::uint8_t>(*value), text.substr(0, equals));
  return true;
}

void skipNumber(CdrReader& reader, std::size_t bytes) {
  switch (bytes) {
    case 1:
      reader.number<std::uint8_t>();
      return;
    case 2:
      reader.number<std::uint16_t>();
      return;
    case 4:
      reader.number<std::uint32_t>();
      return;
    default:
      reader.number<std::uint64_t>();
  }
}

void skip(CdrReader& reader, const Field& field) {
  switch (field.form) {
    case Form::numbers:
      for (std::size_t i = 0; i < field.count && reader.good(); ++i) skipNumber(reader, field.bytes);
      return;
    case Form::text:
      reader.text();
      return;
    case Form::bytes:
      reader.bytes();
      return;
    case Form::named_texts:
      for (auto left = reader.number<std::uint32_t>(); left > 0 && reader.good(); --left) {
        reader.text();
        reader.text();
      }
      return;
    case Form::time:
      reader.number<std::int32_t>();
      reader.number<std::uint32_t>();
  }
}

}  // namespace

std::expected<MessageLayout, std::string> MessageLayout::of(std::string_view schema) {
  MessageLayout layout;
  std::vector<std::pair<std::uint8_t, std::string>> constants;
  while (!schema.empty()) {
    const std::string_view line = schema.substr(0, schema.find('\n'));
    schema.remove_prefix(std::min(line.size() + 1, schema.size()));
    if (line.starts_with("===")) break;  // the definitions of nested types follow
    if (line.empty() || line.starts_with('#')) continue;
    const std::size_t blank = line.find(' ');
    const std::string_view name = blank == std::string_view::npos ? "" : line.substr(blank + 1);
    Field field{std::string(line.substr(0, blank)), std::string(name), {}};
    const bool constant = name.find('=') != std::string_view::npos;
    const bool known = constant ? addConstant(name, constants) : setForm(field.type, field);
    if (name.empty() || !known) {
      return std::unexpected(
          fmt::format("{} in its schema has a type that traces do not use", base::inQuotes(line)));
    }
    if (constant) continue;
    if (layout.fields_.size() >= kMaxFields) {
      return std::unexpected(fmt::format("its schema has more than {} fields", kMaxFields));
    }
    field.constants = std::exchange(constants, {});
    layout.fields_.push_back(std::move(field));
  }
  return layout;
}

std::optional<std::size_t> MessageLayout::find(std::string_view name) const {
  const auto found = std::ranges::find(fields_, name, &Field::name);
  if (found == fields_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - fields_.begin());
}

bool MessageLayout::locate(std::string_view message, std::vector<std::size_t>& places) const {
  CdrReader reader(message);
  places.clear();
  for (const Field& field : fields_) {
    places.push_back(reader.place());
    skip(reader, field);
    if (!reader.good()) return false;
  }
  return reader.complete();
}

}  // namespace hapticd::trace
