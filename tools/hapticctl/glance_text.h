// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "tools/hapticctl/terminal_text.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

/// How a glance is drawn.
struct GlanceStyle {
  TerminalSize size;  ///< nothing is wider, and it takes one row less, for the prompt
  bool colours = false;
  double nominal_rate_hz = std::nan("");  ///< of the force loop, the parameter loop.rate_hz; NaN: not known
};

/// The state on one screen: what is wrong and what to do about it, then the most important of each part. What
/// does not fit is left out from the end; statusText() has all of it. The line of the mode is green only if
/// the force loop is engaged and nothing is wrong.
std::vector<std::string> glanceLines(const Json& status, const GlanceStyle& style);

}  // namespace hapticd::tools
