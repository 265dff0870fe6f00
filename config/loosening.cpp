// SPDX-License-Identifier: Apache-2.0
#include "config/conflicts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <optional>
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

/// The place of a value among those of its parameter.
double rankOf(const Parameter& parameter, const Value& value) {
  if (const bool* const truth = std::get_if<bool>(&value)) return *truth ? 1 : 0;
  if (const auto* const integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
  if (const double* const number = std::get_if<double>(&value)) return *number;
  return static_cast<double>(std::ranges::find(parameter.choices, std::get<std::string>(value)) -
                             parameter.choices.begin());
}

std::string withUnit(std::string text, std::string_view unit) {
  return unit.empty() ? text : fmt::format("{} {}", text, unit);
}

using FixtureField = AdditionField<FixtureSettings>;

/// The number of a member that has a looser side.
double numberOf(const FixtureField& field, const FixtureSettings& fixture) {
  return std::visit(Overloaded{[&](bool FixtureSettings::*member) { return fixture.*member ? 1.0 : 0.0; },
                               [&](double FixtureSettings::*member) { return fixture.*member; },
                               [](const auto&) { return 0.0; }},
                    field.member);
}

/// How one member of a fixture protects less; nothing: it does not. Both are of the same kind, or the member
/// is part of either.
std::optional<std::string> weaknessOf(const FixtureField& field, const FixtureSettings& before,
                                      const FixtureSettings& after) {
  if (isSameIn(field, before, after)) return std::nullopt;
  if (!field.looser) return fmt::format("{} changes", field.name);
  const double from = numberOf(field, before);
  const double to = numberOf(field, after);
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
  for (const auto& field : fixtureFields()) {
    if (!field.used(before) && !field.used(after)) continue;
    if (auto text = weaknessOf(field, before, after)) members.push_back(std::move(*text));
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

template <typename Owner>
auto named(const Owner& owner, const std::vector<Owner>& owners) {
  return std::ranges::find(owners, owner.name, &Owner::name);
}

template <typename Owner>
void addLoosenings(const std::vector<Owner>& before, const std::vector<Owner>& after,
                   std::vector<Loosening>& found) {
  for (const Owner& owner : before) {
    const auto now = named(owner, after);
    const std::string why = now == after.end() ? "is removed" : weakness(owner, *now);
    if (why.empty()) continue;
    const std::string name = fmt::format("{} {}", nounOf(owner), owner.name);
    found.push_back({name, fmt::format("{} {}", name, why)});
  }
}

/// `after` with what is missing in it where it was, and what is weaker in it as it was.
template <typename Owner>
std::vector<Owner> kept(const std::vector<Owner>& before, const std::vector<Owner>& after) {
  std::vector<Owner> result = after;
  auto place = result.begin();
  for (const Owner& owner : before) {
    const auto now = std::ranges::find(result, owner.name, &Owner::name);
    if (now == result.end()) {
      place = std::next(result.insert(place, owner));
      continue;
    }
    if (!weakness(owner, *now).empty()) *now = owner;
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
  addLoosenings(before.additions.frames, after.additions.frames, found);
  addLoosenings(before.additions.fixtures, after.additions.fixtures, found);
  addLoosenings(before.additions.regions, after.additions.regions, found);
  return found;
}

Settings withoutLoosening(const Settings& before, const Settings& after) {
  Settings result = after;
  for (const Parameter& parameter : parameterTable()) {
    const Value value = parameter.get(before);
    if (parameter.effect == Effect::live && isLooser(parameter, value, parameter.get(after)))
      parameter.set(result, value);
  }
  result.additions.frames = kept(before.additions.frames, after.additions.frames);
  result.additions.fixtures = kept(before.additions.fixtures, after.additions.fixtures);
  result.additions.regions = kept(before.additions.regions, after.additions.regions);
  return result;
}

}  // namespace hapticd::config
