// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "config/additions/addition_checks.h"
#include "config/additions/addition_fields.h"
#include "config/additions/addition_reader.h"
#include "config/base/value_text.h"
#include "config/yaml/yaml_reader.h"

namespace hapticd::config {

/// Reads the members of one fixture or region.
template <typename Owner>
class ItemReader {
 public:
  using Field = AdditionField<Owner>;

  /// `place`: what to call it while its name is unknown, e.g. "fixture 2 of the list". `complete`: the parser
  /// has reached the end of `node`.
  ItemReader(const YamlNode& node, const Owner& before, std::string place, bool complete, bool change)
      : node_(node),
        before_(before),
        owner_(before),
        place_(std::move(place)),
        complete_(complete),
        change_(change) {}

  Owner read(std::vector<PlacedAdditionError>& errors) {
    if (node_.type != YamlNode::Type::map) {
      if (node_.type != YamlNode::Type::refused) {
        report(node_.line, "",
               node_.type == YamlNode::Type::null ? "is empty (null), not a mapping of members"
                                                  : "is not a mapping of members",
               "write it as `{name: value, ...}`");
      }
      std::ranges::move(errors_, std::back_inserter(errors));
      return owner_;
    }
    takeName();
    for (const YamlMember& member : node_.members) takeMember(member);
    if (!isVariantUnknown()) checkMembers();
    for (AdditionError& error : checkAlone(owner_, skipped_)) {
      const auto line = lines_.find(error.field);
      errors_.push_back({line == lines_.end() ? node_.line : line->second, std::move(error)});
    }
    std::ranges::move(errors_, std::back_inserter(errors));
    return std::move(owner_);
  }

 private:
  /// A quaternion may be this far from length 1: three digits are enough, and what is none is found.
  static constexpr double kUnitTolerance = 1e-3;
  // The members that decide which others there are.
  static constexpr std::array<std::string_view, 4> kVariantFields{"kind", "place", "shape", "model"};

  void takeName() {
    const YamlMember* const name = node_.find("name");
    if (name != nullptr && name->value.type == YamlNode::Type::scalar) owner_.name = name->value.text;
  }

  void report(int line, std::string_view field, std::string what, std::string remedy) {
    AdditionError error =
        additionError(nounOf(owner_), owner_.name, field, std::move(what), std::move(remedy));
    if (!isAdditionName(owner_.name)) {
      error.error.where = field.empty() ? place_ : fmt::format("{}: {}", place_, field);
    }
    errors_.push_back({line, std::move(error)});
  }
  void refuse(int line, const Field& field, std::string what) {
    report(line, field.name, std::move(what), fmt::format("set {} to {}", field.name, rangeOf(field)));
    skipped_.insert(field.name);
  }

  const Field* fieldNamed(std::string_view name) const {
    for (const Field& field : fieldsOf(owner_)) {
      if (field.name == name) return &field;
    }
    return nullptr;
  }

  std::vector<std::string_view> namesOfFields() const {
    std::vector<std::string_view> names;
    for (const Field& field : fieldsOf(owner_)) {
      if (field.used(owner_)) names.push_back(field.name);
    }
    return names;
  }

  void takeMember(const YamlMember& member) {
    const Field* const field = fieldNamed(member.name);
    if (field == nullptr) {
      std::vector<std::string_view> all;
      for (const Field& each : fieldsOf(owner_)) all.push_back(each.name);
      const std::string guess = base::didYouMean(member.name, all);
      return report(member.line, isAdditionName(member.name) ? member.name : "",
                    fmt::format("there is no member {}", base::inQuotes(member.name)),
                    guess.empty() ? fmt::format("members: {}", fmt::join(all, ", ")) : guess);
    }
    if (const auto [first, inserted] = lines_.emplace(field->name, member.line); !inserted) {
      return report(member.line, field->name, fmt::format("is given twice, first in line {}", first->second),
                    "delete one of the two");
    }
    if (member.value.type == YamlNode::Type::refused) {
      skipped_.insert(field->name);
      return;
    }
    std::visit([&](const auto& place) { assign(member, *field, place); }, field->member);
  }

  /// Returns the text of a scalar, or reports why there is none.
  const std::string* scalarOf(const YamlMember& member, const Field& field) {
    if (member.value.type == YamlNode::Type::scalar) return &member.value.text;
    refuse(member.line, field,
           member.value.type == YamlNode::Type::null  ? "has no value (null)"
           : member.value.type == YamlNode::Type::map ? "is a mapping"
                                                      : "is a list");
    return nullptr;
  }

  void assign(const YamlMember& member, const Field& field, std::string Owner::*place) {
    if (const std::string* text = scalarOf(member, field)) owner_.*place = *text;
  }
  void assign(const YamlMember& member, const Field& field, bool Owner::*place) {
    const std::string* const text = scalarOf(member, field);
    if (text == nullptr) return;
    if ((*text != "true" && *text != "false") || member.value.quoted) {
      return refuse(member.line, field, fmt::format("{} is not a truth value", base::inQuotes(*text)));
    }
    owner_.*place = *text == "true";
  }
  void assign(const YamlMember& member, const Field& field, const WordMember<Owner>& place) {
    const std::string* const text = scalarOf(member, field);
    if (text == nullptr) return;
    const auto word = std::ranges::find(place.words, *text);
    if (word != place.words.end()) {
      return place.set(owner_, static_cast<std::size_t>(word - place.words.begin()));
    }
    const std::string guess = base::didYouMean(*text, place.words);
    report(member.line, field.name, fmt::format("{} is not an allowed choice", base::inQuotes(*text)),
           guess.empty() ? fmt::format("set {} to {}", field.name, rangeOf(field))
                         : fmt::format("{} {}", guess, rangeOf(field)));
    skipped_.insert(field.name);
  }
  void assign(const YamlMember& member, const Field& field, double Owner::*place) {
    if (scalarOf(member, field) == nullptr) return;
    if (const auto number = numberIn(member.line, member.value, field, "")) owner_.*place = *number;
  }
  void assign(const YamlMember& member, const Field& field, int Owner::*place) {
    if (scalarOf(member, field) == nullptr) return;
    const auto number = numberIn(member.line, member.value, field, "");
    if (!number) return;
    if (std::isfinite(*number) && *number == std::trunc(*number) &&
        std::abs(*number) <= std::numeric_limits<int>::max()) {
      owner_.*place = static_cast<int>(*number);
    } else {
      refuse(member.line, field, fmt::format("{} is not a whole number", base::inQuotes(member.value.text)));
    }
  }
  void assign(const YamlMember& member, const Field& field, const VectorMember<Owner>& place) {
    if (const auto vector = vectorIn(member.line, member.value, field, "")) owner_.*place.member = *vector;
  }
  void assign(const YamlMember& member, const Field& field, const QuaternionMember<Owner>& place) {
    const auto numbers = numbersIn<4>(member.line, member.value, field, "");
    if (!numbers) return;
    if (node_.find(place.vector) != nullptr) {
      report(member.line, field.name,
             fmt::format("is given together with {}, which says the same", place.vector),
             "delete one of the two");
      skipped_.insert(field.name);
      return;
    }
    const auto [x, y, z, w] = *numbers;
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    if (!(std::abs(length - 1) <= kUnitTolerance)) {
      return refuse(member.line, field,
                    fmt::format("has the length {:.6g}, and a rotation has the length 1", length));
    }
    owner_.*place.rotation_deg = rotationOf({x / length, y / length, z / length, w / length});
  }
  void assign(const YamlMember& member, const Field& field, std::vector<rt::Vec3> Owner::*place) {
    const YamlNode& list = member.value;
    if (list.type != YamlNode::Type::list) return refuse(member.line, field, "is not a list of points");
    if (list.items.size() > rt::kMaxPathPoints) {
      report(member.line, field.name,
             fmt::format("has {}{} points", complete_ ? "" : "at least ", list.items.size()),
             fmt::format("leave out points of it: at most {} are possible", rt::kMaxPathPoints));
      skipped_.insert(field.name);
      return;
    }
    std::vector<rt::Vec3> points;
    for (std::size_t i = 0; i < list.items.size(); ++i) {
      const auto point = vectorIn(list.items[i].line, list.items[i], field, fmt::format("point {}: ", i + 1));
      if (!point) return;
      points.push_back(*point);
    }
    owner_.*place = std::move(points);
  }

  std::optional<double> numberIn(int line, const YamlNode& node, const Field& field,
                                 const std::string& which) {
    const std::optional<double> number =
        node.type == YamlNode::Type::scalar ? base::yamlNumberFrom(node.text) : std::nullopt;
    if (!number) {
      refuse(line, field, fmt::format("{}{} is not a number", which, base::inQuotes(node.text)));
    } else if (node.quoted) {
      refuse(line, field,
             fmt::format("{}{} is text because of its quotes", which, base::inQuotes(node.text)));
    } else {
      return *number + 0.0;  // turns a negative zero into a positive one
    }
    return std::nullopt;
  }

  template <std::size_t kCount>
  std::optional<std::array<double, kCount>> numbersIn(int line, const YamlNode& node, const Field& field,
                                                      const std::string& which) {
    static_assert(kCount == 3 || kCount == 4);
    if (node.type != YamlNode::Type::list || node.items.size() != kCount) {
      refuse(line, field,
             fmt::format("{}is not a list of {} numbers", which, kCount == 3 ? "three" : "four"));
      return std::nullopt;
    }
    std::array<double, kCount> numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto number = numberIn(line, node.items[i], field, which);
      if (!number) return std::nullopt;
      numbers[i] = *number;
    }
    return numbers;
  }

  std::optional<rt::Vec3> vectorIn(int line, const YamlNode& node, const Field& field,
                                   const std::string& which) {
    const auto numbers = numbersIn<3>(line, node, field, which);
    if (!numbers) return std::nullopt;
    return rt::Vec3{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  }

  /// Whether a member that decides which others there are could not be read or is missing.
  bool isVariantUnknown() {
    bool unknown = false;
    for (const std::string_view name : kVariantFields) {
      const Field* const field = fieldNamed(name);
      if (field == nullptr) continue;
      if (isMissing(*field)) {
        reportMissing(*field);
        unknown = true;
      }
      unknown = unknown || skipped_.contains(name);
    }
    // Without it, every other member might be wrong, or right.
    if (unknown) {
      if (const Field* const name = fieldNamed("name"); isMissing(*name)) reportMissing(*name);
      for (const Field& field : fieldsOf(owner_)) skipped_.insert(field.name);
    }
    return unknown;
  }

  bool isMissing(const Field& field) const {
    if (!complete_ || !field.used(owner_) || !field.required(owner_) || lines_.contains(field.name)) {
      return false;
    }
    return !change_ || !field.used(before_);
  }
  void reportMissing(const Field& field) {
    if (skipped_.contains(field.name)) return;
    report(node_.line, field.name, "is missing", fmt::format("set {} to {}", field.name, rangeOf(field)));
    skipped_.insert(field.name);
  }

  void checkMembers() {
    const Owner defaults;
    for (const Field& field : fieldsOf(owner_)) {
      const auto line = lines_.find(field.name);
      if (!field.used(owner_)) {
        if (line != lines_.end()) {
          report(line->second, field.name,
                 fmt::format("is not a member of a {} of {}", nounOf(owner_), variantOf(owner_)),
                 fmt::format("remove it; its members are: {}", fmt::join(namesOfFields(), ", ")));
        }
        reset(field, defaults);
      } else if (isMissing(field)) {
        reportMissing(field);
      }
    }
  }

  void reset(const Field& field, const Owner& defaults) {
    std::visit(
        Overloaded{[&](auto place) { owner_.*place = defaults.*place; },
                   [&](const WordMember<Owner>& place) { place.set(owner_, place.get(defaults)); },
                   [&](const VectorMember<Owner>& place) { owner_.*place.member = defaults.*place.member; },
                   [](const QuaternionMember<Owner>&) {}},  // the vector of angles is reset
        field.member);
  }

  const YamlNode& node_;
  const Owner& before_;
  Owner owner_;
  std::string place_;
  bool complete_;
  bool change_;
  std::map<std::string_view, int> lines_;  // of the members that are given
  FieldNames skipped_;                     // refused or missing
  std::vector<PlacedAdditionError> errors_;
};

}  // namespace hapticd::config
