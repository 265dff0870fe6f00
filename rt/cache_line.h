// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace hapticd::rt {

/// Bytes that two cores fetch and invalidate as one, on every x86-64 and most arm64 machines. A constant, not
/// `std::hardware_destructive_interference_size`, whose value may differ between translation units.
inline constexpr std::size_t kCacheLine = 64;

}  // namespace hapticd::rt
