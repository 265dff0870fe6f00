// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/dump_schedule.h"

#include <algorithm>
#include <utility>

#include "drivers/trace/trace_folder.h"
#include "rt/clock.h"

namespace hapticd::daemon {
namespace {

using rt::kNsPerSecond;

constexpr std::int64_t kAfterFault_ns = kNsPerSecond;

}  // namespace

DumpSchedule::DumpSchedule(double held_s)
    : held_ns_(static_cast<std::int64_t>(held_s * static_cast<double>(kNsPerSecond))) {}

void DumpSchedule::add(const rt::Tick& tick) {
  const bool faulted = std::exchange(last_mode_, tick.mode) != tick.mode && tick.mode == rt::Mode::faulted;
  const bool burst =
      std::exchange(last_cause_, tick.cause) != tick.cause && tick.cause == rt::Cause::overrun_burst;
  if (held_ns_ <= 0 || !(faulted || burst)) return;
  std::int64_t due_ns = tick.planned_ns + kAfterFault_ns;
  if (!faulted && last_dump_ns_) due_ns = std::max(due_ns, *last_dump_ns_ + held_ns_);
  if (waiting_ && waiting_->due_ns <= due_ns) return;
  waiting_ = Dump{due_ns, std::string(faulted ? drivers::kFaultLabel : drivers::kOverrunBurstLabel)};
}

std::optional<std::string> DumpSchedule::takeDue(std::int64_t now_ns) {
  if (!waiting_ || now_ns < waiting_->due_ns) return std::nullopt;
  last_dump_ns_ = now_ns;
  return takeWaiting();
}

std::optional<std::string> DumpSchedule::takeWaiting() {
  if (!waiting_) return std::nullopt;
  return std::exchange(waiting_, std::nullopt)->label;
}

}  // namespace hapticd::daemon
