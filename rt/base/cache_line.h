// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace hapticd::rt {

/// Size in bytes of the unit in which cores fetch and invalidate memory, on every x86-64 and most arm64
/// machines. A constant rather than `std::hardware_destructive_interference_size`, whose value may differ
/// between translation units.
inline constexpr std::size_t kCacheLine = 64;

}  // namespace hapticd::rt
