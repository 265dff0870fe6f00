// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace hapticd::test {

/// Returns the 640 x 480 raw values of a file with a header of one line and little-endian pixels.
std::vector<std::uint16_t> rawPixelsOf(const std::filesystem::path& file);

}  // namespace hapticd::test
