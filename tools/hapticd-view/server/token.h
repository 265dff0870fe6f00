// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "config/base/error.h"

/// The secret that a client shows. Members of the group haptic-view read it from its file.
namespace hapticd::tools::view {

inline constexpr std::size_t kTokenDigits = 32;  ///< hexadecimal: 128 bits

/// A new token from the kernel's random numbers.
base::Result<std::string> newToken();

/// The token in that file. Where there is no file it is made, with a new token from the kernel's random
/// numbers, readable for its owner and, where it exists, the group haptic-view.
base::Result<std::string> tokenOf(const std::filesystem::path& file);

/// Whether both are equal. The time it takes depends on the lengths alone.
bool isSameToken(std::string_view given, std::string_view expected) noexcept;

}  // namespace hapticd::tools::view
