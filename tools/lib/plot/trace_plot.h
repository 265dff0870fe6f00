// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "config/base/error.h"
#include "config/base/whole_file.h"
#include "daemon/trace/export/selected_trace.h"

namespace hapticd::tools {

/// Draws a trace over time with gnuplot into `image`, a PNG, SVG or PDF by its ending: the modes; the
/// magnitude of the commanded force and its limit; the force per axis; the penetration (distance from the HIP
/// to the proxy); the wake-up latency on a logarithmic axis; and the events as lines, those of experimenters
/// (marks) with their text. Each curve keeps its peaks: at most selection.most_ticks values of each (0:
/// 2000). What the version of the trace did not record, and the penetration where the law has no proxy, is
/// left out, and the title states that. The file is there whole or not at all. Errors: those of readTrace(),
/// another ending, no ticks or nothing to draw in the selection, a file that exists and is not to be
/// replaced, no gnuplot. Thread: any.  RT: not safe.
base::Result<void> plotTrace(const std::filesystem::path& trace, const std::filesystem::path& image,
                             const trace::TraceSelection& selection = {},
                             const trace::Progress& progress = {},
                             base::IfExists if_exists = base::IfExists::refuse);

}  // namespace hapticd::tools
