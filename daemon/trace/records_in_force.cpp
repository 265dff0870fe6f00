// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/records_in_force.h"

#include "rt/base/clock.h"

namespace hapticd::daemon {
namespace {

template <typename Record>
base::Result<void> write(TraceSession& session, std::optional<Record> record) {
  if (!record) return {};
  record->time_ns = rt::monotonicNow_ns();
  return session.write(*record);
}

}  // namespace

base::Result<void> RecordsInForce::writeTo(TraceSession& session) const {
  auto written = write(session, directive);
  return written ? write(session, additions) : written;
}

}  // namespace hapticd::daemon
