// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <type_traits>

#include "config/parameter_table.h"

/// Makes a row of the parameter table from a member of Settings: kind, getter, setter and choices follow from
/// the member's type, the default from its initialiser.
namespace hapticd::config {

/// Words of an enumeration in the order of its enumerators, which start at 0.
template <typename Enumeration>
inline constexpr std::array<std::string_view, 0> kWords{};
template <>
inline constexpr std::array<std::string_view, 5> kWords<LawChoice>{"auto", "nearest_springs",
                                                                   "smooth_springs", "proxy", "surface"};
template <>
inline constexpr std::array<std::string_view, 2> kWords<rt::ModelExtent>{"reach", "frame"};
template <>
inline constexpr std::array<std::string_view, 3> kWords<CameraDriver>{"freenect", "recorded", "synthetic"};
template <>
inline constexpr std::array<std::string_view, 3> kWords<DepthLaw>{"paper", "factory", "custom"};
template <>
inline constexpr std::array<std::string_view, 4> kWords<SyntheticScene>{"plane", "sphere", "moving_sphere",
                                                                        "edge"};
template <>
inline constexpr std::array<std::string_view, 4> kWords<SyntheticNoise>{"off", "quantised", "sensor",
                                                                        "harsh"};
template <>
inline constexpr std::array<std::string_view, 4> kWords<HandleDriver>{"simulated", "udp", "hid", "falcon"};
template <>
inline constexpr std::array<std::string_view, 4> kWords<HandScript>{"stroke", "tap", "lean", "mixed"};
template <>
inline constexpr std::array<std::string_view, 2> kWords<HidKind>{"controller", "spacemouse"};
template <>
inline constexpr std::array<std::string_view, 3> kWords<rt::StiffnessLimit>{"off", "warn", "reduce"};
template <>
inline constexpr std::array<std::string_view, 2> kWords<rt::ContactDamping>{"off", "automatic"};
template <>
inline constexpr std::array<std::string_view, 2> kWords<LedDriver>{"none", "gpiod"};
template <>
inline constexpr std::array<std::string_view, 2> kWords<TraceCompression>{"none", "zstd"};

/// Returns the kind of parameter for a member's type.
template <typename Member>
constexpr Kind kindOf() {
  if constexpr (std::is_same_v<Member, bool>) return Kind::boolean;
  if constexpr (std::is_same_v<Member, int>) return Kind::integer;
  if constexpr (std::is_same_v<Member, double>) return Kind::number;
  if constexpr (std::is_enum_v<Member>) return Kind::choice;
  return Kind::text;
}

/// The type that a Value holds for a member.
template <typename Member>
using Stored = std::conditional_t<
    std::is_same_v<Member, int>, std::int64_t,
    std::conditional_t<std::is_same_v<Member, bool> || std::is_same_v<Member, double>, Member, std::string>>;

/// Returns a member's value in the form used by people and programs.
template <typename Member>
Value valueOf(const Member& member) {
  if constexpr (std::is_enum_v<Member>) {
    return std::string(kWords<Member>.at(static_cast<std::size_t>(member)));
  } else {
    return static_cast<Stored<Member>>(member);
  }
}

/// Sets a member from a value that has passed Parameter::check().
template <typename Member>
void assign(Member& member, const Value& value) {
  const auto& stored = std::get<Stored<Member>>(value);
  if constexpr (std::is_enum_v<Member>) {
    for (std::size_t index = 0; index < kWords<Member>.size(); ++index) {
      if (kWords<Member>[index] == stored) member = static_cast<Member>(index);
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

/// Makes a row. `Access` maps Settings& to a reference to the member.
template <auto Access>
constexpr Parameter row(std::string_view name, Effect effect, std::string_view unit, Range range,
                        std::string_view symbol, std::string_view help) {
  using Member = std::remove_cvref_t<decltype(Access(std::declval<Settings&>()))>;
  return {.name = name,
          .kind = kindOf<Member>(),
          .effect = effect,
          .unit = unit,
          .minimum = range.minimum,
          .maximum = range.maximum,
          .choices = kWords<Member>,
          .symbol = symbol,
          .help = help,
          .get = [](const Settings& settings) { return valueOf<Member>(Access(settings)); },
          .set = [](Settings& settings, const Value& value) { assign<Member>(Access(settings), value); }};
}

}  // namespace hapticd::config

/// The accessor of `settings.path` for row().
#define HAPTICD_MEMBER(path)    \
  [](auto& settings) -> auto& { \
    return settings.path;       \
  }
