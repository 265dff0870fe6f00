// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/base/whole_file.h"
#include "daemon/trace/export/selected_trace.h"
#include "tools/hapticctl/base/calls.h"

namespace hapticd::tools {

/// Options of `trace export`.
struct ExportOptions {
  std::string format = "csv";     ///< or recording
  std::string channel = "ticks";  ///< of a CSV: ticks, models, directives, events
  std::string out;                ///< empty: the trace's name with another ending, in this folder
  base::IfExists if_exists = base::IfExists::refuse;
  trace::TraceSelection selection;
};

/// Options of `trace plot`.
struct PlotOptions {
  std::string out;  ///< .png or .svg; empty: the trace's name with .png, in this folder
  base::IfExists if_exists = base::IfExists::refuse;
  trace::TraceSelection selection;
};

// Each works on a file, without the daemon, prints its result on stdout or its error on stderr, shows
// its progress on stderr where that is a terminal, and returns the exit code.

int runTraceInfo(const CommandOptions& options, const std::filesystem::path& file);
/// `out`: the file to write; empty: the trace's name with "-recovered" beside it.
int runTraceRecover(const CommandOptions& options, const std::filesystem::path& file,
                    const std::string& out);
int runTraceExport(const CommandOptions& options, const std::filesystem::path& file,
                   const ExportOptions& requested);
int runTracePlot(const CommandOptions& options, const std::filesystem::path& file,
                 const PlotOptions& requested);

}  // namespace hapticd::tools
