// SPDX-License-Identifier: Apache-2.0
#include "config/conflicts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <type_traits>
#include <variant>

#include "config/additions/addition_fields.h"
#include "config/base/value_text.h"

namespace hapticd::config {
namespace {

bool isLooser(Looser looser, double before, double after) {
  switch (looser) {
    case Looser::never:
      return false;
    case Looser::higher:
      return after > before;
    case Looser::lower:
      return after < before;
    case Looser::higher_or_zero:
      return before != 0 && (after == 0 || after > before);
  }
  return false;
}

/// The place of a value, of a parameter or a member, among those of its row.
double rankOf(const Row& row, const Value& value) {
  if (const bool* const truth = std::get_if<bool>(&value)) return *truth ? 1 : 0;
  if (const auto* const integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
  if (const double* const number = std::get_if<double>(&value)) return *number;
  return static_cast<double>(std::ranges::find(row.choices, std::get<std::string>(value)) -
                             row.choices.begin());
}

std::string withUnit(std::string text, std::string_view unit) {
  return unit.empty() ? text : fmt::format("{} {}", text, unit);
}

/// How one member of a fixture protects less; nothing: it does not. Both are of the same kind, or the member
/// is part of either.
std::optional<std::string> weaknessOf(const AdditionField& field, const Addition& before,
                                      const Addition& after) {
  if (isSameIn(field, before, after)) return std::nullopt;
  if (!field.looser) return fmt::format("{} changes", field.name);
  const double from = rankOf(field, before.get(field));
  const double to = rankOf(field, after.get(field));
  if (!isLooser(*field.looser, from, to)) return std::nullopt;
  return fmt::format("{} from {} to {}", field.name, base::numberText(from),
                     withUnit(base::numberText(to), field.unit));
}

/// Why `after` protects less than `before`; empty: it does not.
std::string weakness(const FixtureSettings& before, const FixtureSettings& after) {
  if (!before.enabled) return "";
  if (!after.enabled) return "is disabled";
  if (isGuidance(before.kind)) return "";
  std::vector<std::string> members;
  const Addition was(before), is(after);
  for (const AdditionField& field : was.fields()) {
    if (!was.has(field) && !is.has(field)) continue;
    if (auto text = weaknessOf(field, was, is)) members.push_back(std::move(*text));
  }
  return members.empty() ? "" : fmt::format("may protect less: {}", fmt::join(members, ", "));
}

/// A region says what contact is like, which is neither weaker nor stronger.
std::string weakness(const RegionSettings&, const RegionSettings&) {
  return "";
}

/// What a frame's rules protect from depends on its source, so that every change may protect less.
std::string weakness(const FrameSettings& before, const FrameSettings& after) {
  return before == after ? "" : "may protect less: its rules change";
}

void addLoosenings(const auto& before, const auto& after, std::vector<Loosening>& found) {
  for (const auto& item : before) {
    const auto now = std::ranges::find(after, item.name, &std::decay_t<decltype(item)>::name);
    const std::string why = now == after.end() ? "is removed" : weakness(item, *now);
    if (why.empty()) continue;
    const std::string name = fmt::format("{} {}", typeOf(item).noun, item.name);
    found.push_back({name, fmt::format("{} {}", name, why)});
  }
}

/// `result` with what is missing in it where it was, and what is weaker in it as it was.
template <typename Item>
std::vector<Item> kept(const std::vector<Item>& before, std::vector<Item> result) {
  auto place = result.begin();
  for (const Item& item : before) {
    const auto now = std::ranges::find(result, item.name, &Item::name);
    if (now == result.end()) {
      place = std::next(result.insert(place, item));
      continue;
    }
    if (!weakness(item, *now).empty()) *now = item;
    place = std::next(now);
  }
  return result;
}

}  // namespace

bool isLooser(const Parameter& parameter, const Value& before, const Value& after) {
  return isLooser(parameter.looser, rankOf(parameter, before), rankOf(parameter, after));
}

std::vector<Loosening> looseningsOf(const Settings& before, const Settings& after) {
  std::vector<Loosening> found;
  for (const Parameter& parameter : parameterTable()) {
    if (parameter.effect != Effect::live) continue;
    const Value old_value = parameter.get(before);
    const Value new_value = parameter.get(after);
    if (!isLooser(parameter, old_value, new_value)) continue;
    found.push_back(
        {std::string(parameter.name), fmt::format("{} from {} to {}", parameter.name, toText(old_value),
                                                  withUnit(toText(new_value), parameter.unit))});
  }
  forEachList([&found](const auto& was, const auto& is) { addLoosenings(was, is, found); }, before.additions,
              after.additions);
  return found;
}

Settings withoutLoosening(const Settings& before, const Settings& after) {
  Settings result = after;
  for (const Parameter& parameter : parameterTable()) {
    const Value value = parameter.get(before);
    if (parameter.effect == Effect::live && isLooser(parameter, value, parameter.get(after)))
      parameter.set(result, value);
  }
  forEachList([](const auto& was, auto& is) { is = kept(was, is); }, before.additions, result.additions);
  return result;
}

}  // namespace hapticd::config
