// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/client/varlink_client.h"

namespace hapticd::tools {

/// "engaged", "holding: the depth is stale": the mode and, where it says more, its cause.
std::string modeText(const Json& status);

/// What is wrong first: a fault, the camera if it does not stream, the handle if it is absent, then the
/// daemon's warnings.
std::vector<std::string> complaints(const Json& status);

/// "57 s", "12 min", "3.4 h".
std::string uptimeText(double seconds);

/// "writing NAME, 12.0 MB in 57 s", "off, 3 traces": what is written of the ticks.
std::string traceText(const Json& status);

/// "present, gpiod box: power on, camera off"; empty for a box without LEDs, or a daemon that knows none.
std::string ledsText(const Json& status);

/// "hapticd 1.2, kernel 6.1, hapticctl 1.2".
std::string versionsText(const Json& status);

/// "12.3 MB"; "-" for NaN.
std::string bytesText(double bytes);

/// What the law feels: "from 100 points", or, of laws with a proxy, "contact".
std::string contactText(const Json& status);

/// The whole status for people: what is wrong, what is going on, every counter.
std::string statusText(const Json& status);

/// One reply of Monitor in one line.
std::string monitorLine(const Json& reply);

/// The most important of it in less than 90 columns: rate, frames, contact, largest force and latest wake-up
/// since the reply before.
std::string liveLine(const Json& reply);

/// "p50 24.6 us, p99 43.0 us, p99.9 524.3 us, max 9.10 ms" of the distribution at `path`.
std::string latencyText(const Json& status, const std::string& path);

/// The parameter table for people.
std::string parameterTableText(const Json& parameters);

/// "force.stiffness_n_per_m = 500 N/m".
std::string parameterLine(const Json& parameter);

/// "force loop    1000.0 Hz": one row of a status, without a line's end.
std::string statusRow(std::string_view title, const std::string& text);

/// "500 N/m".
std::string withUnit(const std::string& value, const Json& parameter);

}  // namespace hapticd::tools
