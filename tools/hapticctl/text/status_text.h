// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tools/lib/client/reply_reader.h"
#include "tools/lib/client/varlink_client.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {

/// "engaged", "holding: the depth is stale": the mode and, if it adds information, its cause.
std::string modeText(const Json& status);

/// What is wrong with the box, each with its remedy: the daemon's list, which every surface shows.
std::vector<std::string> warningsOf(const Json& status);

/// "writing NAME, 12.0 MB in 57 s", "off, 3 finished since the start": the state of the trace.
std::string traceText(const Json& status);

/// "present, gpiod box: power on, camera off"; empty for a box without LEDs, or a daemon that reports none.
std::string ledsText(const Json& status);

/// "hapticd 1.2, kernel 6.1, hapticctl 1.2".
std::string versionsText(const Json& status);

/// The source of the force: "from 100 points", or, of laws with a proxy, "contact".
std::string contactText(const Json& status);

/// The content of the newest scene: "4000 points", or the pixels on which the law `surface` works instead.
std::string sceneContentText(const Json& status);

/// The whole status for people: what is wrong, the state of each part, every counter.
std::string statusText(const Json& status);

/// One reply of Monitor in one line.
std::string monitorLine(const Json& reply);

/// The most important fields of it in less than 90 columns: rate, frames, contact, largest force and latest
/// wake-up since the reply before.
std::string liveLine(const Json& reply);

/// Size and colours of a glance.
struct GlanceStyle {
  TerminalSize size;  ///< nothing is wider, and it takes one row less, for the prompt
  bool colours = false;
};

/// Returns the state on one screen: warnings with their remedies, then the most important values of each
/// part. Lines that do not fit are omitted from the end; statusText() has all of it. The line of the mode is
/// green only if the force loop is engaged and nothing is wrong.
std::vector<std::string> glanceLines(const Json& status, const GlanceStyle& style);

/// What hapticd-ros publishes and takes, and what does not arrive, as text. status: the content of its status
/// file; columns: of the terminal.
std::string rosStatusText(const Json& status, std::size_t columns);

}  // namespace hapticd::tools
