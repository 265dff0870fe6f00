// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

/// The fields of a structure that leaves the process: one table beside the structure, from which follow the
/// schema of traces, their columns as CSV, the JSON of the control API, its interface text and the metrics.
///
///     template <std::same_as<SceneStatus> Status>
///     constexpr auto fieldsOf(std::type_identity<Status>) {
///       return std::tuple{HAPTICD_FIELD(frames, "Frames taken over from the
///       camera").counter("scene_frames")};
///     }
///
/// fieldsOf() is a template so that only those who use the table pay for it.
namespace hapticd::rt {

/// A name made of the path of a member.
class FieldName {
 public:
  constexpr FieldName() = default;
  constexpr explicit FieldName(std::string_view text) {
    for (const char c : text) add(c);
  }
  /// "handle.delay_s" as "handleDelayS".
  static constexpr FieldName inCamelCase(std::string_view path) {
    FieldName name;
    bool begins_word = false;
    for (const char c : path) {
      const bool separates = c == '_' || c == '.';
      if (!separates) name.add(begins_word && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c);
      begins_word = separates;
    }
    return name;
  }
  /// "handle.delay_s" as "handle_delay_s".
  static constexpr FieldName inSnakeCase(std::string_view path) {
    FieldName name;
    for (const char c : path) name.add(c == '.' ? '_' : c);
    return name;
  }
  constexpr std::string_view text() const { return {characters_.data(), size_}; }

 private:
  constexpr void add(char c) { characters_.at(size_++) = c; }

  std::array<char, 48> characters_{};
  std::size_t size_ = 0;
};

/// Nothing for a number that is 0 where it is not known.
constexpr std::optional<double> ifPositive(double number) noexcept {
  return number > 0 ? std::optional(number) : std::nullopt;
}

/// What monitoring makes of a field.
enum class MetricKind : std::uint8_t {
  none,
  gauge,
  counter,
  summary,  ///< a LatencySummary
  states,   ///< an enumeration
};

/// In place of what clients see of a field: nothing.
struct NotShown {};

/// A row of the table.
/// `Get` maps a structure to a reference to the member, `Show` to what clients see of it.
template <typename Get, typename Show>
struct Field {
  std::string_view path;  ///< of the member, "handle.delay_s"; its last word is the unit
  std::string_view help;  ///< a sentence without its full stop
  Get get;
  Show show;
  FieldName trace_name;          ///< in traces
  FieldName json_name;           ///< in the control API
  std::string_view metric = {};  ///< name of the metric, with its unit; empty: none
  MetricKind metric_kind = MetricKind::none;

  constexpr Field named(std::string_view name) const {
    Field field = *this;
    field.json_name = FieldName(name);
    return field;
  }
  constexpr auto hidden() const { return shownAs(NotShown{}); }
  constexpr Field tracedAs(std::string_view name) const {
    Field field = *this;
    field.trace_name = FieldName(name);
    return field;
  }
  constexpr Field gauge(std::string_view name) const { return measured(name, MetricKind::gauge); }
  constexpr Field counter(std::string_view name) const { return measured(name, MetricKind::counter); }
  constexpr Field summary(std::string_view name) const { return measured(name, MetricKind::summary); }
  constexpr Field states(std::string_view name) const { return measured(name, MetricKind::states); }
  /// Shows `show(structure)`; an empty optional is null in JSON.
  template <typename OtherShow>
  constexpr Field<Get, OtherShow> shownAs(OtherShow other) const {
    return {path, help, get, other, trace_name, json_name, metric, metric_kind};
  }

 private:
  constexpr Field measured(std::string_view name, MetricKind kind) const {
    Field field = *this;
    field.metric = name;
    field.metric_kind = kind;
    return field;
  }
};

template <typename Get>
constexpr Field<Get, Get> field(std::string_view path, std::string_view help, Get get) {
  return {path, help, get, get, FieldName::inSnakeCase(path), FieldName::inCamelCase(path)};
}

#define HAPTICD_FIELD(path, help) \
  ::hapticd::rt::field(           \
      #path, help, [](auto& record) -> auto& { return record.path; })

/// A field of which traces need no more than its name, and the control API nothing.
#define HAPTICD_TRACED(path) HAPTICD_FIELD(path, "").hidden()

/// A structure that has its table beside it.
template <typename Record>
concept Tabled = requires {
  fieldsOf(std::type_identity<Record>{});
};

/// Stands for any member where the number of members is counted.
struct AnyMember {
  template <typename Member>
  operator Member() const noexcept;  // NOLINT: implicit on purpose, and never called
};

template <typename Aggregate, std::size_t... kIndex>
consteval bool isMadeOf(std::index_sequence<kIndex...>) {
  return requires {
    Aggregate{(static_cast<void>(kIndex), AnyMember{})...};
  };
}

/// The number of members of a structure without constructors.
template <typename Aggregate, std::size_t kAtLeast = 0>
consteval std::size_t memberCount() {
  if constexpr (isMadeOf<Aggregate>(std::make_index_sequence<kAtLeast + 1>())) {
    return memberCount<Aggregate, kAtLeast + 1>();
  } else {
    return kAtLeast;
  }
}

/// The member that a path begins with.
constexpr std::string_view memberIn(std::string_view path) {
  return path.substr(0, path.find('.'));
}

/// The number of members that the paths of the rows begin with. Rows of one member need not stand together.
template <typename Fields, std::size_t... kIndex>
consteval std::size_t memberCountOf(const Fields& fields, std::index_sequence<kIndex...>) {
  const std::array<std::string_view, sizeof...(kIndex)> members{memberIn(std::get<kIndex>(fields).path)...};
  std::size_t count = 0;
  for (std::size_t i = 0; i < members.size(); ++i) {
    bool is_new = true;
    for (std::size_t j = 0; j < i; ++j) is_new = is_new && members[j] != members[i];
    count += is_new ? 1 : 0;
  }
  return count;
}

/// The rows of a structure. Each of its members must have one, or a part of it, or the program does not
/// compile.
template <Tabled Record>
consteval auto checkedFieldsOf() {
  constexpr auto fields = fieldsOf(std::type_identity<Record>{});
  constexpr auto index = std::make_index_sequence<std::tuple_size_v<std::remove_const_t<decltype(fields)>>>();
  static_assert(memberCountOf(fields, index) == memberCount<Record>(), "each member needs a row");
  return fields;
}

template <Tabled Record>
inline constexpr auto kFields = checkedFieldsOf<Record>();

/// Calls visit(field) for each row, in their order.
template <Tabled Record>
constexpr void forEachField(auto&& visit) {
  [&]<std::size_t... kIndex>(std::index_sequence<kIndex...>) {
    (visit(std::get<kIndex>(kFields<Record>)), ...);
  }
  (std::make_index_sequence<std::tuple_size_v<std::remove_const_t<decltype(kFields<Record>)>>>());
}

/// Calls visit(field) for each row that clients see.
template <Tabled Record>
constexpr void forEachShownField(auto&& visit) {
  forEachField<Record>([&visit]<typename Get, typename Show>(const Field<Get, Show>& field) {
    if constexpr (!std::is_same_v<Show, NotShown>) visit(field);
  });
}

}  // namespace hapticd::rt
