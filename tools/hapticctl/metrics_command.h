// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/hapticctl/calls.h"

namespace hapticd::tools {

/// Prints the state as OpenMetrics text; returns the exit code.
int runMetrics(const CommandOptions& options);

/// Reads one HTTP request on stdin and answers it on stdout. A daemon that does not answer is no error:
/// hapticd_up is 0. Returns the exit code.
int runMetricsOverHttp(const CommandOptions& options);

}  // namespace hapticd::tools
