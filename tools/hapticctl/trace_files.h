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
  std::string format = "csv";          ///< recording, or rosbag2
  std::string channel = "ticks";       ///< of a CSV: ticks, models, directives, events
  std::string out;                     ///< empty: the trace's name with another ending, in this folder
  std::string name_space = "hapticd";  ///< of a bag's topics
  base::IfExists if_exists = base::IfExists::refuse;
  trace::TraceSelection selection;
};

/// Options of `trace plot`.
struct PlotOptions {
  std::string out;  ///< .png, .svg or .pdf; empty: the trace's name with the format, in this folder
  std::string format = "png";  ///< png, svg or pdf, where `out` is empty
  base::IfExists if_exists = base::IfExists::refuse;
  trace::TraceSelection selection;
};

// Each works on a file, without the daemon, prints its result on stdout or its error on stderr, shows its
// progress on stderr where that is a terminal, and returns the exit code.

int runTraceInfo(const CommandOptions& options, const std::filesystem::path& file);
int runTraceBreaches(const CommandOptions& options, const std::filesystem::path& file);
/// `out`: the file to write; empty: the trace's name with "-recovered" beside it.
int runTraceRecover(const CommandOptions& options, const std::filesystem::path& file, const std::string& out);
int runTraceExport(const CommandOptions& options, const std::filesystem::path& file,
                   const ExportOptions& requested);
int runTracePlot(const CommandOptions& options, const std::filesystem::path& file,
                 const PlotOptions& requested);

}  // namespace hapticd::tools
