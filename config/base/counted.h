// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <concepts>
#include <string>
#include <string_view>

namespace hapticd::base {

/// "1 tick in contact" and "2 ticks in contact" of "tick(s) in contact": each "(s)" of `words` is the ending
/// of the plural, which every count but "1" has. Thread: any. RT: not safe.
inline std::string counted(std::string_view count, std::string_view words) {
  constexpr std::string_view kEnding = "(s)";
  std::string text = fmt::format("{} {}", count, words);
  for (std::size_t at = 0; (at = text.find(kEnding, at)) != std::string::npos;)
    text.replace(at, kEnding.size(), count == "1" ? "" : "s");
  return text;
}

inline std::string counted(std::integral auto count, std::string_view words) {
  return counted(std::string_view(fmt::format("{}", count)), words);
}

}  // namespace hapticd::base
