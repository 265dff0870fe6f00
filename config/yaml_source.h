// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hapticd::config {

/// A name or a value as the parser has read it.
struct SourceScalar {
  std::size_t at = 0;  ///< byte of the text where it begins, with its quote if it has one
  std::string value;
  bool name = false;  ///< a colon must follow
};

/// What of a text the parser has not understood as it stands there.
struct SourceProblem {
  int line = 0;  ///< 1 for the first
  std::string what;
  std::string remedy;
};

/// Compares a text with what the parser made of it, `scalars` in their order. yaml-cpp passes over what it
/// can make nothing of without a word, and text in quotes may run over lines: either way names vanish. So
/// each scalar must stand on one line as its value says, a colon behind it if it is a name, and between them
/// may only be blanks, comments and the punctuation of maps. Returns the first place where that does not
/// hold. `complete`: the parser has come to the end of the text; what is behind the last scalar is not looked
/// at else.
std::optional<SourceProblem> sourceProblem(std::string_view text, std::span<const SourceScalar> scalars,
                                           bool complete);

}  // namespace hapticd::config
