// SPDX-License-Identifier: Apache-2.0
#include "config/loosening.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <variant>

#include "config/addition_fields.h"
#include "config/value_text.h"

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

/// How one member of a fixture protects less; nothing: it does not. `before` and `after` are of the same
/// kind.
class MemberChange {
 public:
  using Field = AdditionField<FixtureSettings>;

  MemberChange(const Field& field, const FixtureSettings& before, const FixtureSettings& after)
      : field_(field), before_(before), after_(after) {}

  std::optional<std::string> text() const {
    return std::visit([this](const auto& member) { return textOf(member); }, field_.member);
  }

 private:
  template <typename Member>
  std::optional<std::string> textOf(Member FixtureSettings::*member) const {
    if constexpr (std::is_same_v<Member, bool>) {
      return ofNumbers(before_.*member ? 1 : 0, after_.*member ? 1 : 0);
    } else if constexpr (std::is_arithmetic_v<Member>) {
      return ofNumbers(before_.*member, after_.*member);
    } else {
      return ofShape(before_.*member == after_.*member);
    }
  }
  std::optional<std::string> textOf(const WordMember<FixtureSettings>& member) const {
    return ofShape(member.get(before_) == member.get(after_));
  }
  std::optional<std::string> textOf(const VectorMember<FixtureSettings>& member) const {
    return ofShape(before_.*member.member == after_.*member.member);
  }

  std::optional<std::string> textOf(const QuaternionMember<FixtureSettings>&) const { return std::nullopt; }

  std::optional<std::string> ofNumbers(double before, double after) const {
    if (!field_.looser) return ofShape(before == after);
    if (!isLooser(*field_.looser, before, after)) return std::nullopt;
    return fmt::format("{} from {} to {}", field_.name, numberText(before),
                       withUnit(numberText(after), field_.unit));
  }
  std::optional<std::string> ofShape(bool same) const {
    if (same) return std::nullopt;
    return fmt::format("{} changes", field_.name);
  }

  const Field& field_;
  const FixtureSettings& before_;
  const FixtureSettings& after_;
};

/// Why `after` protects less than `before`; empty: it does not.
std::string weakness(const FixtureSettings& before, const FixtureSettings& after) {
  if (!before.enabled) return "";
  if (!after.enabled) return "is disabled";
  if (isGuidance(before.kind)) return "";
  std::vector<std::string> members;
  for (const auto& field : fixtureFields()) {
    if (!field.used(before) && !field.used(after)) continue;
    if (auto text = MemberChange(field, before, after).text()) members.push_back(std::move(*text));
  }
  return members.empty() ? "" : fmt::format("may protect less: {}", fmt::join(members, ", "));
}

/// A region says what contact is like, which is neither weaker nor stronger.
std::string weakness(const RegionSettings&, const RegionSettings&) {
  return "";
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
  result.additions.fixtures = kept(before.additions.fixtures, after.additions.fixtures);
  result.additions.regions = kept(before.additions.regions, after.additions.regions);
  return result;
}

}  // namespace hapticd::config
