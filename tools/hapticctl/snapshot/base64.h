// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace hapticd::tools {

/// The bytes that base64 text with padding stands for; nothing when it is none. Source: RFC 4648, section 4.
std::optional<std::string> base64Decoded(std::string_view text);

}  // namespace hapticd::tools
