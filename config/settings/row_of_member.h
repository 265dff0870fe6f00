// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "config/settings/parameter_table.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/laws/law_table.h"

/// Makes a row from a member: kind, getter, setter and choices follow from its type, the default from its
/// initialiser; of a parameter, name and effect from the member's path in Settings.
///
/// The rows of the stiffness stand here too, which is a number or chosen automatically. While it is
/// automatic, the stiffness of the springs is the ceiling, in whichever order the two are set.
namespace hapticd::config {

/// The words that a member of this type may have, in the order of the enumerators; empty for types that are
/// not enumerations.
template <typename Member>
inline constexpr std::array<std::string_view, 0> kWords{};
template <rt::Worded Enumeration>
inline constexpr auto kWords<Enumeration> = rt::kWords<Enumeration>;
template <>
inline constexpr auto kWords<LawChoice> = [] {
  constexpr auto& kLaws = rt::kWords<rt::ForceLaw>;
  std::array<std::string_view, 1 + kLaws.size()> words{kAutomaticLaw};
  std::ranges::copy(kLaws, words.begin() + 1);
  return words;
}();

/// For each of kWords a line of help for users; empty if there is none.
template <typename Member>
inline constexpr std::array<std::string_view, 0> kWordHelp{};
template <>
inline constexpr auto kWordHelp<LawChoice> = [] {
  std::array<std::string_view, 1 + rt::kForceLaws.size()> help{
      "the cheapest of the measured laws whose error is within force.max_error_n with the camera's noise at "
      "the scene's distance"};
  std::ranges::transform(rt::kForceLaws, help.begin() + 1, &rt::ForceLawRow::help);
  return help;
}();

/// Whether members of this type hold one of kWords.
template <typename Member>
inline constexpr bool kIsChoice = !kWords<Member>.empty();

/// Returns the index of a member's word in kWords. `auto`, the absence of a law, precedes the laws.
template <typename Member>
constexpr std::size_t wordIndex(const Member& member) {
  if constexpr (std::is_enum_v<Member>) {
    return static_cast<std::size_t>(member);
  } else {
    return member ? 1 + static_cast<std::size_t>(*member) : 0;
  }
}

/// Returns the member whose word has this index in kWords, which must exist.
template <typename Member>
constexpr Member memberAt(std::size_t index) {
  if constexpr (std::is_enum_v<Member>) {
    return static_cast<Member>(index);
  } else {
    return index == 0 ? Member{} : static_cast<typename Member::value_type>(index - 1);
  }
}

/// Returns the kind of parameter for a member's type.
template <typename Member>
constexpr Kind kindOf() {
  if constexpr (std::is_same_v<Member, bool>) return Kind::boolean;
  if constexpr (std::is_same_v<Member, int>) return Kind::integer;
  if constexpr (std::is_same_v<Member, double>) return Kind::number;
  if constexpr (std::is_same_v<Member, rt::Vec3>) return Kind::vector;
  if constexpr (std::is_same_v<Member, std::vector<rt::Vec3>>) return Kind::points;
  if constexpr (kIsChoice<Member>) return Kind::choice;
  return Kind::text;
}

/// The type that a Value holds for a member.
template <typename Member>
using Stored = std::conditional_t<std::is_same_v<Member, int>, std::int64_t,
                                  std::conditional_t<kIsChoice<Member>, std::string, Member>>;

/// Returns a member's value in the form used by people and programs; empty for a word that does not exist.
template <typename Member>
Value valueOf(const Member& member) {
  if constexpr (kIsChoice<Member>) {
    const std::size_t index = wordIndex(member);
    return std::string(index < kWords<Member>.size() ? kWords<Member>[index] : "");
  } else {
    return static_cast<Stored<Member>>(member);
  }
}

/// Sets a member from a value that has been checked.
template <typename Member>
void assign(Member& member, const Value& value) {
  const auto& stored = std::get<Stored<Member>>(value);
  if constexpr (kIsChoice<Member>) {
    for (std::size_t index = 0; index < kWords<Member>.size(); ++index) {
      if (kWords<Member>[index] == stored) member = memberAt<Member>(index);
    }
  } else {
    member = static_cast<Member>(stored);
  }
}

/// Allowed range of a number, both ends inclusive.
struct Range {
  double minimum = 0;
  double maximum = 0;
};

/// The path of a parameter's member in Settings: `live.group.name` or `group.name`. Any other does not
/// compile.
struct MemberPath {
  std::string_view name;  ///< "group.name"
  Effect effect;

  consteval explicit MemberPath(std::string_view path)
      : name(path.substr(path.starts_with(kLive) ? kLive.size() : 0)),
        effect(path.starts_with(kLive) ? Effect::live : Effect::restart) {
    if (std::ranges::count(name, '.') != 1)
      throw "the member must be settings.group.name or settings.live.group.name";
  }

 private:
  static constexpr std::string_view kLive = "live.";
};

/// The row of a member of this type.
template <typename Member>
constexpr Row rowOf(std::string_view name, std::string_view unit, Range range, std::string_view help) {
  return {.name = name,
          .kind = kindOf<Member>(),
          .unit = unit,
          .minimum = range.minimum,
          .maximum = range.maximum,
          .choices = kWords<Member>,
          .choice_help = kWordHelp<Member>,
          .help = help};
}

/// Makes the row of a parameter. `Access` maps Settings& to a reference to the member.
template <auto Access>
constexpr Parameter row(std::string_view name, Effect effect, std::string_view unit, Range range,
                        std::string_view symbol, std::string_view help, Looser looser = Looser::never) {
  using Member = std::remove_cvref_t<decltype(Access(std::declval<Settings&>()))>;
  return {rowOf<Member>(name, unit, range, help),
          effect,
          symbol,
          [](const Settings& settings) { return valueOf<Member>(Access(settings)); },
          [](Settings& settings, const Value& value) { assign<Member>(Access(settings), value); },
          looser};
}

/// Makes the row of the member at this path.
template <auto Access>
constexpr Parameter rowAt(MemberPath path, std::string_view unit, Range range, std::string_view symbol,
                          std::string_view help, Looser looser = Looser::never) {
  return row<Access>(path.name, path.effect, unit, range, symbol, help, looser);
}

}  // namespace hapticd::config

/// The accessor of `settings.path` for row().
#define HAPTICD_MEMBER(path)    \
  [](auto& settings) -> auto& { \
    return settings.path;       \
  }
/// The row of `settings.path`: unit, {minimum, maximum}, the paper's symbol, help, and of limits which value
/// is looser.
#define HAPTICD_PARAMETER(path, ...) \
  hapticd::config::rowAt<HAPTICD_MEMBER(path)>(hapticd::config::MemberPath(#path), __VA_ARGS__)

namespace hapticd::config {

inline constexpr std::string_view kAutomaticStiffness = "auto";
inline constexpr std::array kStiffnessWords{kAutomaticStiffness};

/// Makes the row of the stiffness one of a number or `auto`.
constexpr Parameter orAutomatic(Parameter stiffness) {
  stiffness.choices = kStiffnessWords;
  stiffness.get = [](const Settings& settings) -> Value {
    if (settings.live.force.stiffness_is_automatic) return std::string(kAutomaticStiffness);
    return settings.live.force.stiffness_n_per_m;
  };
  stiffness.set = [](Settings& settings, const Value& value) {
    const auto* const number = std::get_if<double>(&value);
    rt::ForceParameters& force = settings.live.force;
    force.stiffness_is_automatic = number == nullptr;
    force.stiffness_n_per_m = number != nullptr ? *number : force.stiffness_ceiling_n_per_m;
  };
  return stiffness;
}

/// Makes the row of the ceiling one that an automatic stiffness follows.
constexpr Parameter ofAutomatic(Parameter ceiling) {
  ceiling.set = [](Settings& settings, const Value& value) {
    rt::ForceParameters& force = settings.live.force;
    force.stiffness_ceiling_n_per_m = std::get<double>(value);
    if (force.stiffness_is_automatic) force.stiffness_n_per_m = force.stiffness_ceiling_n_per_m;
  };
  return ceiling;
}

}  // namespace hapticd::config
