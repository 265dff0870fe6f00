#pragma once

#include <filesystem>
#include <string>

#include "tools/hapticctl/calls.h"

namespace hapticd::tools {

/// What `trace export` makes of a trace.
struct ExportOptions {
  std::string format = "csv";  ///< csv or hdf5
  std::string out;             ///< empty: the trace's name with another ending, in this folder
  bool force = false;          ///< replace an existing file
};

/// What `trace plot` makes of a trace.
struct PlotOptions {
  std::string out;  ///< empty: the trace's name with another ending, in this folder
  bool force = false;
};

// Each works on a file, without the daemon, prints its result on stdout or its error on stderr, shows its
// progress on stderr where that is a terminal, and returns the exit code.

int runTraceInfo(const CommandOptions& options, const std::filesystem::path& file);
int runTraceRecover(const CommandOptions& options, const std::filesystem::path& file);
int runTraceExport(const CommandOptions& options, const std::filesystem::path& file,
                   const ExportOptions& wanted);
int runTracePlot(const CommandOptions& options, const std::filesystem::path& file, const PlotOptions& wanted);

}  // namespace hapticd::tools
