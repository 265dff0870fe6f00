// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "daemon/trace/export/trace_summary.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

/// The report of `trace breaches` for people: a table of the fixtures and a list of their breaches.
/// `columns`: of the terminal.
std::string breachText(const trace::BreachReport& report, std::size_t columns);

/// The same for programs; null: not known.
Json breachJson(const trace::BreachReport& report);

}  // namespace hapticd::tools
