// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

/// Names of contents.
namespace hapticd::base {

/// Returns the SHA-256 (FIPS 180-4) of bytes as 64 hexadecimal digits in small letters.
/// Thread: any.  RT: not safe.
std::string sha256(std::string_view bytes);

/// Whether a text has the form of such a name.
bool isSha256(std::string_view text) noexcept;

}  // namespace hapticd::base
