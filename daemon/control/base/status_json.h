// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "daemon/control/server/varlink_message.h"
#include "daemon/status/box_status.h"

namespace hapticd::daemon {

/// The state as the types `Status` and `Window` of io.hapticd.Status, as the rows beside their structures
/// say.
OrderedJson statusJson(const BoxStatus& status);
/// Null where none waits.
OrderedJson pendingReloadJson(const std::optional<PendingReload>& pending);
OrderedJson windowJson(const WindowStatus& window);
/// A fixture as the type of `each` in `Status`.
OrderedJson conductJson(const FixtureConduct& conduct);
/// A tick as the type `Tick` of io.hapticd.Status.
OrderedJson tickJson(const rt::Tick& tick);

}  // namespace hapticd::daemon
