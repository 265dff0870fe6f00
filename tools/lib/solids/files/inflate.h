// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::solids {

/// Bytes of a gzip stream.
struct Inflated {
  std::string bytes;
  bool has_more = false;  ///< the stream continues behind the longest
};

/// Returns the bytes of a gzip stream of one member or more, up to `longest` of them. Allocates no more than
/// about twice what the stream really contains.
/// Errors: not gzip, damaged, truncated. What comes behind `longest` bytes is not looked at.
base::Result<Inflated> inflated(std::string_view stream, std::size_t longest, const std::string& name);

}  // namespace hapticd::solids
