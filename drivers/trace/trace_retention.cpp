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
  const TraceEntry* newest = nullptr;
  for (const TraceEntry& trace : traces) {
    if (isOrdinary(trace) && !trace.damaged) newest = &trace;
  }
  for (const TraceEntry& trace : traces) {
    plan.bytes += trace.bytes;
    if (trace.kept) ++plan.kept;
    if (!trace.kept && isDumpName(trace.name)) ++plan.dumps;
    if (!isOrdinary(trace) || &trace == newest || trace.name == just_finished) {
      plan.protected_bytes += trace.bytes;
    } else {
      plan.deletable.push_back(trace);
    }
  }
  return plan;
}

}  // namespace hapticd::drivers
