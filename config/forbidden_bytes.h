// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::config {

/// A place in a text with bytes that are not allowed.
struct ForbiddenBytes {
  int line = 0;  ///< 1 for the first
  std::string what;
  std::string remedy;
};

/// Finds everything that must not occur in a YAML file, at most one find per line: bytes that are not UTF-8,
/// control characters, and tabs in the indentation.
std::vector<ForbiddenBytes> forbiddenBytesIn(std::string_view text);

}  // namespace hapticd::config
