// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "rt/enumeration.h"

/// The words of enumerations. Each stands once, beside its enumeration, as
///
///     constexpr auto wordsOf(Mode) { return rt::words<Mode>("starting", "idle", "engaged"); }
///
/// and is what configurations, the control interface, traces, metrics and messages write. An enumerator
/// without its word does not compile.
namespace hapticd::rt {

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

/// The word of an enumerator. `value` is one: what comes from outside is checked where it enters.
template <Worded Enumeration>
constexpr std::string_view wordOf(Enumeration value) noexcept {
  return kWords<Enumeration>[static_cast<std::size_t>(value)];
}

/// The enumerator that a word stands for; nothing: it is the word of none.
template <Worded Enumeration>
constexpr std::optional<Enumeration> withWord(std::string_view word) noexcept {
  for (std::size_t value = 0; value < kWords<Enumeration>.size(); ++value) {
    if (kWords<Enumeration>[value] == word) return static_cast<Enumeration>(value);
  }
  return std::nullopt;
}

}  // namespace hapticd::rt
