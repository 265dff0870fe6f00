// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hapticd::tools {

/// A depth camera by the ids of its USB device.
struct KnownCamera {
  std::uint16_t vendor;
  std::uint16_t product;  ///< kAnyProduct: all of the vendor
  const char* name;
  const char* obstacle;  ///< why hapticd cannot use it; empty: it can
};

inline constexpr std::uint16_t kAnyProduct = 0;

/// Returns the depth camera with these ids; null for other devices.
const KnownCamera* knownCamera(std::uint16_t vendor, std::uint16_t product);

}  // namespace hapticd::tools
