// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

inline constexpr const char* kOpenMetricsType = "application/openmetrics-text; version=1.0.0; charset=utf-8";
inline constexpr const char* kPrometheusType = "text/plain; version=0.0.4; charset=utf-8";

/// OpenMetrics 1.0, or Prometheus' own text format, version 0.0.4, which `promtool check metrics` reads.
/// Sources: the OpenMetrics specification, version 1.0.0; prometheus.io, "Exposition formats".
enum class MetricsFormat { open_metrics, prometheus };

/// The status as metrics: families hapticd_*, base units (seconds, bytes, newtons, metres), states as
/// StateSet, durations as summaries whose quantile 1 is the maximum, "# EOF" at the end. Prometheus' format
/// has the same samples, with gauges for the types that it lacks. What the daemon does not report is left
/// out. `status` null: the daemon does not respond, and hapticd_up is 0.
std::string metricsOf(const Json& status, MetricsFormat format = MetricsFormat::open_metrics);

/// A label's value with backslash, quote and line feed escaped.
std::string labelValue(std::string_view text);

}  // namespace hapticd::tools
