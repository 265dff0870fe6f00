// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>

#include "tools/client/reply_reader.h"

namespace hapticd::tools {

/// What a stream of Monitor replies amounts to.
class WatchSummary {
 public:
  void add(const Json& reply);
  /// Several lines for people: ticks, overruns, frames, points, force range and percentiles. Counters and
  /// percentiles are the daemon's since its start, the force range is that of the replies added.
  std::string text() const;

 private:
  Json status_;
  double min_force_n_ = std::nan("");
  double max_force_n_ = std::nan("");
};

}  // namespace hapticd::tools
