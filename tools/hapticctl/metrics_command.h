// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/hapticctl/calls.h"
#include "tools/hapticctl/open_metrics.h"

namespace hapticd::tools {

/// Prints the state as metrics; returns the exit code.
int runMetrics(const CommandOptions& options, MetricsFormat format);

/// Reads one HTTP request on stdin and replies on stdout. A daemon that does not respond is no error:
/// hapticd_up is 0. Returns the exit code.
int runMetricsOverHttp(const CommandOptions& options);

}  // namespace hapticd::tools
