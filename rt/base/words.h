// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

/// The words of enumerations. Those of an enumeration are defined once, beside it, as
///
///     constexpr auto wordsOf(Mode) { return rt::words<Mode>("starting", "idle", "engaged"); }
///
/// and are used by configurations, the control interface, traces, metrics and messages. An enumerator without
/// its word does not compile.
namespace hapticd::rt {

/// True if `Value` is a named enumerator of its type. g++ and clang print the name of an enumerator, and a
/// cast such as "(Type)4" for every other value.
template <auto Value>
consteval bool isEnumerator() {
  const std::string_view function = __PRETTY_FUNCTION__;
  return function.substr(function.rfind("= ") + 2).front() != '(';
}

/// The number of enumerators of an enumeration that counts from 0 without gaps. A table with a row for each
/// enumerator asserts it, so that an enumerator without a row does not compile.
template <typename Enumeration, std::size_t first = 0>
consteval std::size_t enumeratorCount() {
  if constexpr (isEnumerator<static_cast<Enumeration>(first)>()) {
    return enumeratorCount<Enumeration, first + 1>();
  } else {
    return first;
  }
}

/// The words of an enumeration that counts from 0, in the order of its enumerators.
template <typename Enumeration, typename... Word>
consteval auto words(Word... word) {
  static_assert(sizeof...(word) == enumeratorCount<Enumeration>(), "each enumerator needs one word");
  return std::array<std::string_view, sizeof...(word)>{word...};
}

/// An enumeration that has its words beside it.
template <typename Type>
concept Worded = requires(Type value) {
  wordsOf(value);
};

/// All words of an enumeration; the index is the enumerator's value.
template <Worded Enumeration>
inline constexpr auto kWords = wordsOf(Enumeration{});

/// Returns the word of `value`, which must be an enumerator: values from outside are checked where they
/// enter.
template <Worded Enumeration>
constexpr std::string_view wordOf(Enumeration value) noexcept {
  return kWords<Enumeration>[static_cast<std::size_t>(value)];
}

/// Returns the enumerator that has this word, or nothing.
template <Worded Enumeration>
constexpr std::optional<Enumeration> withWord(std::string_view word) noexcept {
  for (std::size_t value = 0; value < kWords<Enumeration>.size(); ++value) {
    if (kWords<Enumeration>[value] == word) return static_cast<Enumeration>(value);
  }
  return std::nullopt;
}

}  // namespace hapticd::rt
