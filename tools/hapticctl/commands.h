// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/whole_file.h"
#include "daemon/trace/export/selected_trace.h"
#include "tools/hapticctl/base/calls.h"
#include "tools/hapticctl/snapshot/snapshot.h"
#include "tools/hapticctl/text/open_metrics.h"

namespace hapticd::tools {

struct EventOptions {
  bool follow = false;             ///< go on with new events
  int count = 20;                  ///< the number of past events to show at most
  std::vector<std::string> kinds;  ///< empty: all
};

/// Prints past events, and with `follow` new ones until Ctrl-C, a line each. While it follows it survives a
/// restart of the daemon: it connects again, and reports that on standard error. Returns the exit code.
int runEvents(const CommandOptions& options, const EventOptions& events);

/// The daemon's newest depth frame. Without one the error has been printed, and the exit code is returned.
std::expected<Snapshot, int> fetchSnapshot(const CommandOptions& options);

/// The longest head of a request, in bytes, that is read.
inline constexpr std::size_t kMaxRequestBytes = 8192;

/// Whether `received` contains the whole head of a request.
bool isWholeRequest(std::string_view received);

/// The reply to one HTTP/1 request of which `received` is the head: GET or HEAD of /metrics get what
/// `metrics` returns, everything else gets the appropriate error. The form is OpenMetrics unless the request
/// names the media types that it accepts and none of them is OpenMetrics or any at all. The connection is
/// closed after the reply.
std::string httpReply(std::string_view received,
                      const std::function<std::string(MetricsFormat format)>& metrics);

/// Prints the state as metrics; returns the exit code.
int runMetrics(const CommandOptions& options, MetricsFormat format);

/// Reads one HTTP request on stdin and replies on stdout. A daemon that does not respond is no error:
/// hapticd_up is 0. Returns the exit code.
int runMetricsOverHttp(const CommandOptions& options);

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
