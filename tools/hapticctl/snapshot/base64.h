// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace hapticd::tools {

/// Decodes base64 with padding; nothing if the text is not base64. Source: RFC 4648, section 4.
std::optional<std::string> base64Decoded(std::string_view text);

}  // namespace hapticd::tools
