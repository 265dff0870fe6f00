// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hapticd::base {

/// Bytes as base64 text with padding. Source: RFC 4648, section 4.
std::string base64(std::span<const std::uint8_t> bytes);

/// The bytes of a base64 text with padding; nothing if it is none.
std::optional<std::string> base64Decoded(std::string_view text);

}  // namespace hapticd::base
