// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "config/settings/fixture_settings.h"
#include "config/settings/parameter_table.h"
#include "rt/base/vec3.h"

/// The members of fixtures and regions: one table each, from which the reader, the checks, the texts and the
/// documentation follow.
namespace hapticd::config {

/// A member that is one of several words.
template <typename Owner>
struct WordMember {
  std::span<const std::string_view> words;
  std::size_t (*get)(const Owner&);        ///< index of the word
  void (*set)(Owner&, std::size_t index);  ///< must exist
};

/// What the three components of a vector are.
enum class VectorUse { place, direction, size, angles };
template <typename Owner>
struct VectorMember {
  rt::Vec3 Owner::*member;
  VectorUse use;
};

/// Another way to give a vector of angles: a unit quaternion [x, y, z, w]. It is read only, and what is
/// written is the vector.
template <typename Owner>
struct QuaternionMember {
  rt::Vec3 Owner::*rotation_deg;
  std::string_view vector;  ///< name of the member with the angles
};

/// One member.
template <typename Owner>
struct AdditionField {
  using Member = std::variant<std::string Owner::*, bool Owner::*, int Owner::*, double Owner::*,
                              std::vector<rt::Vec3> Owner::*, WordMember<Owner>, VectorMember<Owner>,
                              QuaternionMember<Owner>>;

  std::string_view name;
  std::string_view unit;  ///< empty for pure numbers and words
  Member member;
  double minimum = 0;              ///< of numbers and of components of vectors, inclusive
  double maximum = 0;              ///< inclusive
  bool (*used)(const Owner&);      ///< whether the fixture or region has this member
  bool (*required)(const Owner&);  ///< whether it must be given; only where it is used
  std::string_view help;           ///< one line
  /// Which value protects less; nothing: any other one may, as of a member of the shape.
  std::optional<Looser> looser = std::nullopt;
};

template <typename... Visitor>
struct Overloaded : Visitor... {
  using Visitor::operator()...;
};

/// Whether a member is the same in both.
template <typename Owner>
bool isSameIn(const AdditionField<Owner>& field, const Owner& a, const Owner& b) {
  return std::visit(
      Overloaded{[&](auto member) { return a.*member == b.*member; },
                 [&](const WordMember<Owner>& member) { return member.get(a) == member.get(b); },
                 [&](const VectorMember<Owner>& member) { return a.*member.member == b.*member.member; },
                 // the vector of angles is compared
                 [](const QuaternionMember<Owner>&) { return true; }},
      field.member);
}

/// Whether a text of the fixture or region has this member.
template <typename Owner>
bool isWritten(const AdditionField<Owner>& field, const Owner& owner) {
  return field.used(owner) && !std::holds_alternative<QuaternionMember<Owner>>(field.member);
}

/// All members of a fixture, in the order in which they are written.
std::span<const AdditionField<FixtureSettings>> fixtureFields();
/// All members of a region.
std::span<const AdditionField<RegionSettings>> regionFields();

/// All members of a frame.
std::span<const AdditionField<FrameSettings>> frameFields();

/// The table of a type, by overload.
inline auto fieldsOf(const FixtureSettings&) {
  return fixtureFields();
}
inline auto fieldsOf(const RegionSettings&) {
  return regionFields();
}

inline auto fieldsOf(const FrameSettings&) {
  return frameFields();
}

/// The words of RegionSettings::place.
inline constexpr std::array<std::string_view, 2> kPlaceWords{"shape", "label"};

/// The word for messages: "fixture", "region" or "frame".
constexpr std::string_view nounOf(const FixtureSettings&) {
  return "fixture";
}
constexpr std::string_view nounOf(const RegionSettings&) {
  return "region";
}

constexpr std::string_view nounOf(const FrameSettings&) {
  return "frame";
}

/// What decides which members there are, for messages: "kind sphere", "place label".
std::string variantOf(const FixtureSettings& fixture);
std::string variantOf(const RegionSettings& region);
std::string variantOf(const FrameSettings& frame);

/// Whether the name is one for a fixture or region: 1 to 32 letters, digits, '_' and '-'.
bool isAdditionName(std::string_view name);

/// Returns the range of a field, for example "0.0001..10 m" or "one of: out, in, both".
template <typename Owner>
std::string rangeOf(const AdditionField<Owner>& field);
extern template std::string rangeOf(const AdditionField<FixtureSettings>&);
extern template std::string rangeOf(const AdditionField<RegionSettings>&);
extern template std::string rangeOf(const AdditionField<FrameSettings>&);

}  // namespace hapticd::config
