// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/error.h"

namespace hapticd::drivers::udp {

inline constexpr std::size_t kFewestKeyBytes = 16;
inline constexpr std::size_t kMostKeyBytes = 1024;

/// All bytes of the file, as they are; an empty path gives an empty key.
/// Errors: the file cannot be read, others than its owner and its group may read or write it, or its size is
/// not kFewestKeyBytes to kMostKeyBytes.
config::Result<std::vector<std::byte>> keyFrom(const std::string& path);

}  // namespace hapticd::drivers::udp
