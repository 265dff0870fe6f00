// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_retention.h"

#include <algorithm>

namespace hapticd::drivers {
namespace {

/// Returns whether the trace is ordinary; the newest ordinary one is never deleted.
bool isOrdinary(const TraceEntry& trace) {
  return !trace.open && !trace.kept && !isDumpName(trace.name);
}

}  // namespace

RetentionPlan planRetention(std::span<const TraceEntry> traces, std::string_view just_finished) {
  RetentionPlan plan;
  for (const TraceEntry& trace : traces) {
    plan.bytes += trace.bytes;
    if (trace.kept) ++plan.kept;
    if (!trace.kept && isDumpName(trace.name)) ++plan.dumps;
    if (isOrdinary(trace)) plan.deletable.push_back(trace);
  }
  if (!plan.deletable.empty()) plan.deletable.pop_back();  // the newest one
  std::erase_if(plan.deletable, [=](const TraceEntry& trace) { return trace.name == just_finished; });
  plan.protected_bytes = plan.bytes;
  for (const TraceEntry& trace : plan.deletable) plan.protected_bytes -= trace.bytes;
  return plan;
}

}  // namespace hapticd::drivers
