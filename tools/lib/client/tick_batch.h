// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "rt/loop/loop_state.h"
#include "tools/lib/client/varlink_client.h"

/// The ticks of the stream io.hapticd.Status.Ticks.
namespace hapticd::tools {

/// The names of all fields of a tick, as io.hapticd.Status.Ticks takes them.
Json allTickFields();

/// Rebuilds the ticks of a reply of io.hapticd.Status.Ticks and hands over each, oldest first. A number that
/// is null becomes NaN, or infinite where that is the default. A field that is missing, of another type or
/// unknown keeps its default, because the daemon may be of another version.
void forEachTick(const Json& reply, const std::function<void(const rt::Tick&)>& take);

}  // namespace hapticd::tools
