// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

/// Summarises a stream of Monitor replies.
class WatchSummary {
 public:
  void add(const Json& reply);
  /// The summary in several lines for people: ticks, overruns, frames, points, force range and percentiles.
  /// Counters and percentiles are those of the daemon since its start, the force range is that of the added
  /// replies.
  std::string text() const;

 private:
  Json status_;
  double min_force_n_ = std::nan("");
  double max_force_n_ = std::nan("");
};

}  // namespace hapticd::tools
