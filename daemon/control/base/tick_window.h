// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "daemon/status/box_status.h"
#include "rt/base/latency_histogram.h"

namespace hapticd::daemon {

/// Summarises ticks until the summary has been read.
/// Thread: one.
class TickWindow {
 public:
  void add(const rt::Tick& tick);
  void clear() { *this = TickWindow(); }

  WindowStatus summary() const;

 private:
  struct Times {
    rt::LatencyHistogram wakeup_latency;
    rt::LatencyHistogram compute_time;
  };

  WindowStatus summary_;                                      ///< without the percentiles
  std::unique_ptr<Times> times_ = std::make_unique<Times>();  // 8 KiB, too much to be moved
};

}  // namespace hapticd::daemon
