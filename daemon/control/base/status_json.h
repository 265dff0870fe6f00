// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/base/box.h"
#include "daemon/control/base/tick_window.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {

/// The state as the types `Status` and `Window` of io.hapticd.Status. Field names are those of the C++
/// structures in camelCase.
OrderedJson statusJson(const BoxStatus& status);
/// Null where none waits.
OrderedJson pendingReloadJson(const std::optional<PendingReload>& pending);
OrderedJson windowJson(const TickWindow& window);
/// A tick as the type `Tick` of io.hapticd.Status.
OrderedJson tickJson(const rt::Tick& tick);

}  // namespace hapticd::daemon
