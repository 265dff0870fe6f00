// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "config/base/error.h"
#include "daemon/trace/trace_session.h"
#include "drivers/trace/format/records.h"

namespace hapticd::daemon {

/// The newest of the records that hold until they are replaced, with which each trace starts.
struct RecordsInForce {
  std::optional<drivers::DirectiveRecord> directive = {};
  std::optional<drivers::AdditionsRecord> additions = {};  ///< fixtures and tissue regions

  /// Writes them with the present time: otherwise the trace would seem to start when they were issued.
  /// Errors: those of the session.
  base::Result<void> writeTo(TraceSession& session) const;
};

}  // namespace hapticd::daemon
