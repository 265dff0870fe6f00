// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

inline constexpr const char* kOpenMetricsType = "application/openmetrics-text; version=1.0.0; charset=utf-8";
inline constexpr const char* kPrometheusType = "text/plain; version=0.0.4; charset=utf-8";

/// The status as OpenMetrics 1.0 text: families hapticd_*, base units (seconds, bytes, newtons, metres),
/// states as StateSet, durations as summaries whose quantile 1 is the maximum, "# EOF" at the end. What the
/// daemon does not report is left out. `status` null: the daemon does not respond, and hapticd_up is 0.
/// Source: the OpenMetrics specification, version 1.0.0.
std::string openMetricsOf(const Json& status);

/// The status in Prometheus' own text format, version 0.0.4, which `promtool check metrics` reads: the same
/// samples, with gauges for the types that this format lacks. Source: prometheus.io, "Exposition formats".
std::string prometheusTextOf(const Json& status);

/// A label's value with backslash, quote and line feed escaped.
std::string labelValue(std::string_view text);

}  // namespace hapticd::tools
