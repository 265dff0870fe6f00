// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "daemon/base/box.h"
#include "rt/base/latency_histogram.h"

namespace hapticd::daemon {

/// Summarises ticks until the summary has been read.
/// Thread: one.
class TickWindow {
 public:
  void add(const rt::Tick& tick);
  void clear() { *this = TickWindow(); }

  const WindowSummary& summary() const { return summary_; }
  LatencySummary wakeupLatency() const { return summaryOf(times_->wakeup_latency); }
  LatencySummary computeTime() const { return summaryOf(times_->compute_time); }

 private:
  struct Times {
    rt::LatencyHistogram wakeup_latency;
    rt::LatencyHistogram compute_time;
  };

  WindowSummary summary_;
  std::unique_ptr<Times> times_ = std::make_unique<Times>();  // 8 KiB, too much to be moved
};

}  // namespace hapticd::daemon
