// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {

/// Size and colours of a glance.
struct GlanceStyle {
  TerminalSize size;  ///< nothing is wider, and it takes one row less, for the prompt
  bool colours = false;
};

/// Returns the state on one screen: warnings with their remedies, then the most important values of each
/// part. Lines that do not fit are omitted from the end; statusText() has all of it. The line of the mode is
/// green only if the force loop is engaged and nothing is wrong.
std::vector<std::string> glanceLines(const Json& status, const GlanceStyle& style);

}  // namespace hapticd::tools
