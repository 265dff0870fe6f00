// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "config/base/value_text.h"
#include "config/settings/parameter_table.h"

namespace hapticd::config {
namespace {

// PATH_MAX of Linux without the terminating NUL: the longest text that any parameter can use.
constexpr std::size_t kMaxTextLength = 4095;

base::Error refusal(const Parameter& parameter, std::string_view what) {
  return {.where = std::string(parameter.name),
          .what = fmt::format("{} (allowed: {})", what, parameter.range()),
          .remedy = {}};
}

base::Error refusal(const Parameter& parameter, std::string_view shown, std::string_view why) {
  return refusal(parameter, fmt::format("{} {}", shown, why));
}

// Constructed in place: g++ 12 warns about uninitialised memory when a temporary Value is moved under the
// address sanitizer.
template <typename Stored>
base::Result<Value> accepted(const Stored& stored) {
  return base::Result<Value>(std::in_place, stored);
}

std::string withUnit(std::string_view shown, std::string_view unit) {
  return unit.empty() ? std::string(shown) : fmt::format("{} {}", shown, unit);
}

// `shown` is the number as written by the person.
base::Result<Value> checkNumber(const Parameter& parameter, double number, std::string_view shown) {
  if (const std::string problem = parameter.problemOf(number, shown); !problem.empty())
    return std::unexpected(refusal(parameter, problem));
  if (parameter.kind == Kind::integer) return accepted(static_cast<std::int64_t>(number));
  return accepted(number + 0.0);  // turns a negative zero into a positive one
}

base::Result<Value> checkChoice(const Parameter& parameter, const std::string& word) {
  if (std::ranges::find(parameter.choices, word) != parameter.choices.end()) return accepted(word);
  return std::unexpected(refusal(parameter, base::inQuotes(word), "is not an allowed choice"));
}

base::Result<Value> checkText(const Parameter& parameter, const std::string& text) {
  if (text.size() > kMaxTextLength) {
    return std::unexpected(
        refusal(parameter, base::inQuotes(text), fmt::format("is longer than {} bytes", kMaxTextLength)));
  }
  if (base::firstInvalidUtf8(text))
    return std::unexpected(refusal(parameter, base::inQuotes(text), "is not valid UTF-8"));
  if (base::firstUnprintable(text)) {
    return std::unexpected(
        refusal(parameter, base::inQuotes(text), "contains a control or invisible character"));
  }
  return accepted(text);
}

base::Result<Value> parseBoolean(const Parameter& parameter, std::string_view text) {
  if (text == "true" || text == "false") return accepted(text == "true");
  return std::unexpected(refusal(parameter, base::inQuotes(text), "is not a truth value"));
}

bool isWordOf(const Parameter& parameter, std::string_view text) {
  return std::ranges::find(parameter.choices, text) != parameter.choices.end();
}

base::Result<Value> parseNumber(const Parameter& parameter, std::string_view text) {
  if (isWordOf(parameter, text)) return accepted(std::string(text));
  const std::optional<double> number = base::yamlNumberFrom(text);
  if (!number) return std::unexpected(refusal(parameter, base::inQuotes(text), "is not a number"));
  const bool short_enough = text.size() <= 40;
  return checkNumber(parameter, *number, short_enough ? std::string(text) : base::inQuotes(text));
}

std::string_view nameOfType(const Value& value) {
  if (std::holds_alternative<bool>(value)) return "a truth value";
  if (std::holds_alternative<std::string>(value)) return "text";
  return "a number";
}

base::Error wrongType(const Parameter& parameter, const Value& value) {
  const auto* text = std::get_if<std::string>(&value);
  return refusal(
      parameter, text != nullptr ? base::inQuotes(*text) : toText(value),
      fmt::format("is {}{}", nameOfType(value),
                  parameter.kind == Kind::integer || parameter.kind == Kind::number ? ", not a number" : ""));
}

}  // namespace

Value Parameter::defaultValue() const {
  return get(Settings{});
}

std::string Row::range() const {
  const std::string numbers =
      withUnit(fmt::format("{}..{}", base::numberText(minimum), base::numberText(maximum)), unit);
  switch (kind) {
    case Kind::boolean:
      return "true or false";
    case Kind::integer:
    case Kind::number:
      return choices.empty() ? numbers : fmt::format("{} or {}", numbers, fmt::join(choices, ", "));
    case Kind::choice:
      return fmt::format("one of: {}", fmt::join(choices, ", "));
    case Kind::text:
      return "text";
    case Kind::name:
      return "1 to 32 letters, digits, '_' and '-'";
    case Kind::frame:
      return "world, camera or one of the list frames";
    case Kind::hash:
      return "64 hexadecimal digits in small letters";
    case Kind::vector:
      return "[x, y, z], each " + numbers;
    case Kind::direction:
      return "[x, y, z], any length except zero";
    case Kind::quaternion:
      return "[x, y, z, w] of length 1, without rotation_deg";
    case Kind::points:
      return "2 to 256 points [x, y, z], each " + numbers;
  }
  return "";
}

std::string Row::problemOf(double number, std::string_view shown) const {
  if (!std::isfinite(number)) return fmt::format("{} is not a finite number", shown);
  if (kind == Kind::integer && number != std::trunc(number))
    return fmt::format("{} is not a whole number", shown);
  if (number >= minimum && number <= maximum) return "";
  return withUnit(shown, unit) + " is out of range";
}

base::Result<Value> Parameter::check(const Value& value) const {
  const auto* text = std::get_if<std::string>(&value);
  switch (kind) {
    case Kind::boolean:
      if (std::holds_alternative<bool>(value)) return value;
      break;
    case Kind::integer:
    case Kind::number:
      if (const auto* integer = std::get_if<std::int64_t>(&value)) {
        return checkNumber(*this, static_cast<double>(*integer), toText(value));
      }
      if (const auto* number = std::get_if<double>(&value)) return checkNumber(*this, *number, toText(value));
      if (text != nullptr && isWordOf(*this, *text)) return value;
      break;
    case Kind::choice:
      if (text != nullptr) return checkChoice(*this, *text);
      break;
    default:
      if (text != nullptr) return checkText(*this, *text);
      break;
  }
  return std::unexpected(wrongType(*this, value));
}

base::Result<Value> Parameter::parse(std::string_view text) const {
  switch (kind) {
    case Kind::boolean:
      return parseBoolean(*this, text);
    case Kind::integer:
    case Kind::number:
      return parseNumber(*this, text);
    default:
      return check(Value(std::string(text)));
  }
}

std::string toText(const Value& value) {
  const auto vector = [](const rt::Vec3& v) {
    return fmt::format("[{}, {}, {}]", base::numberText(v.x), base::numberText(v.y), base::numberText(v.z));
  };
  if (const auto* place = std::get_if<rt::Vec3>(&value)) return vector(*place);
  if (const auto* points = std::get_if<std::vector<rt::Vec3>>(&value)) {
    std::vector<std::string> texts;
    std::ranges::transform(*points, std::back_inserter(texts), vector);
    return fmt::format("[{}]", fmt::join(texts, ", "));
  }
  if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *integer);
  if (const auto* number = std::get_if<double>(&value)) return base::numberText(*number);
  return std::get<std::string>(value);
}

}  // namespace hapticd::config
