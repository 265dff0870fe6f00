// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace hapticd::tools {

/// `text` so that roff prints it as it stands: backslashes and hyphens escaped, no line begins with a
/// request. A list without blanks may break after its commas.
std::string plainRoff(std::string_view text);

/// A paragraph with a hanging label in bold: `.TP`, the label, the text.
std::string labelled(std::string_view label, std::string_view text);

}  // namespace hapticd::tools
