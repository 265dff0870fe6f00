// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/tick_window.h"

#include <algorithm>

namespace hapticd::daemon {

void TickWindow::add(const rt::Tick& tick) {
  const double force_n = rt::norm(tick.command_force_n_in_world);
  ++summary_.ticks;
  if (rt::inContact(tick)) ++summary_.contact_ticks;
  summary_.min_force_n = std::min(summary_.min_force_n.value_or(force_n), force_n);
  summary_.max_force_n = std::max(summary_.max_force_n.value_or(force_n), force_n);
  summary_.max_wakeup_latency_ns =
      std::max(summary_.max_wakeup_latency_ns.value_or(tick.wakeup_latency_ns), tick.wakeup_latency_ns);
  times_->wakeup_latency.add(tick.wakeup_latency_ns);
  times_->compute_time.add(tick.compute_ns);
}

WindowStatus TickWindow::summary() const {
  WindowStatus summary = summary_;
  if (summary.ticks == 0) return summary;
  summary.wakeup_latency = rt::summaryOf(times_->wakeup_latency);
  summary.compute_time = rt::summaryOf(times_->compute_time);
  return summary;
}

}  // namespace hapticd::daemon
