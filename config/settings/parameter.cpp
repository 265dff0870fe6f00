// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "config/base/value_text.h"
#include "config/settings/parameter_table.h"

namespace hapticd::config {
namespace {

// PATH_MAX of Linux without the terminating NUL: the longest text that any parameter can use.
constexpr std::size_t kMaxTextLength = 4095;

base::Error refusal(const Parameter& parameter, std::string_view shown, std::string_view why) {
  return {.where = std::string(parameter.name),
          .what = fmt::format("{} {} (allowed: {})", shown, why, parameter.range()),
          .remedy = {}};
}

// Constructed in place: g++ 12 warns about uninitialised memory when a temporary Value is moved under the
// address sanitizer.
template <typename Stored>
base::Result<Value> accepted(const Stored& stored) {
  return base::Result<Value>(std::in_place, stored);
}

std::string withUnit(std::string_view shown, const Parameter& parameter) {
  return parameter.unit.empty() ? std::string(shown) : fmt::format("{} {}", shown, parameter.unit);
}

// `shown` is the number as written by the person.
base::Result<Value> checkNumber(const Parameter& parameter, double number, std::string_view shown) {
  if (!std::isfinite(number)) return std::unexpected(refusal(parameter, shown, "is not a finite number"));
  if (parameter.kind == Kind::integer && number != std::trunc(number)) {
    return std::unexpected(refusal(parameter, shown, "is not a whole number"));
  }
  if (!(number >= parameter.minimum && number <= parameter.maximum)) {
    return std::unexpected(refusal(parameter, withUnit(shown, parameter), "is out of range"));
  }
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

std::string Parameter::range() const {
  switch (kind) {
    case Kind::boolean:
      return "true or false";
    case Kind::integer:
    case Kind::number: {
      const std::string numbers =
          withUnit(fmt::format("{}..{}", base::numberText(minimum), base::numberText(maximum)), *this);
      return choices.empty() ? numbers : fmt::format("{} or {}", numbers, fmt::join(choices, ", "));
    }
    case Kind::choice:
      return fmt::format("one of: {}", fmt::join(choices, ", "));
    case Kind::text:
      break;
  }
  return "text";
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
    case Kind::text:
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
    case Kind::choice:
    case Kind::text:
      break;
  }
  return check(Value(std::string(text)));
}

std::string toText(const Value& value) {
  if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *integer);
  if (const auto* number = std::get_if<double>(&value)) return base::numberText(*number);
  return std::get<std::string>(value);
}

}  // namespace hapticd::config
