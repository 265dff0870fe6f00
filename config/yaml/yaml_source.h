// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/yaml/yaml_node.h"

namespace hapticd::config {

/// A name or a value as read by the parser.
struct SourceScalar {
  std::size_t at = 0;  ///< offset of its first byte, including its quote if it has one
  std::string value;
  bool name = false;     ///< a colon must follow
  bool in_list = false;  ///< the punctuation of lists may be beside it
};

/// Compares a text with the parser's `scalars`, in order. yaml-cpp silently skips what it cannot interpret,
/// and quoted text may extend over lines; in both cases names would vanish. Therefore each scalar must be on
/// one line, as its value indicates, followed by a colon if it is a name, and only blanks, comments and the
/// punctuation of maps (and of lists, beside scalars of lists) may be between them. Returns the first place
/// that violates this. `complete`: the parser has reached the end of the text; otherwise, what follows the
/// last scalar is not checked.
std::optional<YamlProblem> sourceProblem(std::string_view text, std::span<const SourceScalar> scalars,
                                         bool complete);

}  // namespace hapticd::config
