// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

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

}  // namespace hapticd::tools
