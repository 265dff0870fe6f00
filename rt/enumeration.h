// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

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

}  // namespace hapticd::rt
