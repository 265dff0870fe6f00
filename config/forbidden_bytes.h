// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::config {

struct ForbiddenBytes {
  int line = 0;  ///< 1 for the first
  std::string what;
  std::string remedy;
};

/// What may not stand in a YAML file at all, at most one find per line: bytes that are no UTF-8, control
/// characters, and tabs in the indentation.
std::vector<ForbiddenBytes> forbiddenBytesIn(std::string_view text);

}  // namespace hapticd::config
