// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/base/error.h"

namespace hapticd::drivers::udp {

inline constexpr std::size_t kMinKeyBytes = 16;
inline constexpr std::size_t kMaxKeyBytes = 1024;

/// Reads a key: all bytes of the file as they are. An empty path gives an empty key.
/// Errors: the file cannot be read, users other than its owner and group may read or write it, or its size is
/// not within kMinKeyBytes to kMaxKeyBytes.
base::Result<std::vector<std::byte>> keyFrom(const std::string& path);

}  // namespace hapticd::drivers::udp
