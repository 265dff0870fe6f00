// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "tools/hapticctl/base/calls.h"
#include "tools/hapticctl/doctor/examination.h"

namespace hapticd::tools {

/// What the daemon reports of itself: its state, its devices and its parameters. It is not asked where that
/// would start the service, through its socket units, or where other files than those of this machine are
/// examined, unless its socket is named. unit: of the service, as far as it is known.
/// Thread: any. RT: not safe.
DaemonView daemonView(const CommandOptions& options, const std::optional<UnitProperties>& unit,
                      bool this_machine);

}  // namespace hapticd::tools
