// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/settings/fixture_settings.h"
#include "config/settings/parameter_table.h"

/// The members of fixtures, regions and frames: one row each, from which the reader, the checks, the texts,
/// the options of hapticctl and the documentation follow. They look at a fixture, region or frame as its rows
/// show it.
namespace hapticd::config {

/// What a fixture, region or frame is, as bits: its kind, and what else decides which members it has.
using Traits = std::uint32_t;

/// The row of a member.
struct AdditionField : Row {
  Traits used;      ///< those that have one of these traits have the member
  Traits required;  ///< and it must be given to these
  Value (*get)(const void* item);
  void (*set)(void* item, const Value& value);  ///< a word must be one of `choices`
  /// Which value protects less; nothing: any other one may, as of a member of the shape.
  std::optional<Looser> looser;
};

class AdditionChecks;

/// One of the lists that people add to the scene, and what its items are.
struct AdditionType {
  std::string_view noun;                  ///< "fixture": for messages
  std::string_view list;                  ///< "fixtures": of its list, in files and calls
  std::size_t most;                       ///< that the force loop has room for
  std::span<const AdditionField> fields;  ///< in the order in which they are written, the name first
  const void* defaults;                   ///< an item that has only these
  Traits (*traits)(const void* item);
  std::string (*variant)(const void* item);
  void (*checkRules)(const void* item, AdditionChecks& checks);
};

const AdditionType& typeOf(const FixtureSettings&);
const AdditionType& typeOf(const RegionSettings&);
const AdditionType& typeOf(const FrameSettings&);

template <typename Item>
concept Added = std::same_as<Item, FixtureSettings> || std::same_as<Item, RegionSettings> ||
    std::same_as<Item, FrameSettings>;

/// A fixture, region or frame that somebody else owns.
class Addition {
 public:
  template <Added Item>
  Addition(const Item& item) : type_(&typeOf(item)), item_(&item) {}  // NOLINT: implicit on purpose
  Addition(const AdditionType& type, const void* item) : type_(&type), item_(item) {}

  const AdditionType& type() const { return *type_; }
  std::span<const AdditionField> fields() const { return type_->fields; }
  std::string name() const { return std::get<std::string>(fields().front().get(item_)); }
  Traits traits() const { return type_->traits(item_); }
  /// What decides which members it has, for messages: "kind sphere", "place label".
  std::string variant() const { return type_->variant(item_); }

  Value get(const AdditionField& field) const { return field.get(item_); }
  bool has(const AdditionField& field) const { return (field.used & traits()) != 0; }
  /// Whether a text of it has this member.
  bool writes(const AdditionField& field) const { return has(field) && field.kind != Kind::quaternion; }
  void check(AdditionChecks& checks) const { type_->checkRules(item_, checks); }

  /// Null for an item of another list.
  template <Added Item>
  const Item* as() const {
    return type_ == &typeOf(Item{}) ? static_cast<const Item*>(item_) : nullptr;
  }

 private:
  const AdditionType* type_;
  const void* item_;
};

/// The same of one that may be changed.
class ChangeableAddition : public Addition {
 public:
  template <Added Item>
  ChangeableAddition(Item& item) : Addition(item), item_(&item) {}  // NOLINT: implicit on purpose

  void set(const AdditionField& field, const Value& value) { field.set(item_, value); }

 private:
  void* item_;
};

/// A list of fixtures, regions or frames that somebody else owns.
class AdditionSpan {
 public:
  template <Added Item>
  AdditionSpan(const std::vector<Item>& items)  // NOLINT: implicit on purpose
      : type_(&typeOf(Item{})), items_(items.data()), count_(items.size()), bytes_(sizeof(Item)) {}

  const AdditionType& type() const { return *type_; }
  std::size_t size() const { return count_; }
  Addition operator[](std::size_t index) const {
    return {*type_, static_cast<const std::byte*>(items_) + index * bytes_};
  }

 private:
  const AdditionType* type_;
  const void* items_;
  std::size_t count_;
  std::size_t bytes_;
};

/// Calls visit(list..) with the frames, the fixtures and the regions of all of `additions`, which are
/// SceneAdditions or alike.
constexpr void forEachList(auto&& visit, auto&... additions) {
  visit(additions.frames...);
  visit(additions.fixtures...);
  visit(additions.regions...);
}

/// Whether a member is the same in both, which are of one list. Of a rotation, the angles are compared.
bool isSameIn(const AdditionField& field, const Addition& a, const Addition& b);

/// Whether the name is one for a fixture, region or frame.
bool isAdditionName(std::string_view name);

/// Returns the range of a field, for example "0.0001..10 m" or "one of: out, in, both".
std::string rangeOf(const AdditionField& field);

/// A definition in one line, for people; valid in YAML and in JSON.
std::string lineOf(const Addition& item);

}  // namespace hapticd::config
