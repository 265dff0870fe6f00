// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/box.h"

/// The names of enumerators ("engaged", "depth_stale") as both interfaces and the journal use them.
namespace hapticd::daemon {

const char* nameOf(drivers::CameraState state);
const char* nameOf(drivers::HandlePresence state);
const char* nameOf(drivers::LedState state);
const char* nameOf(TraceState state);
const char* nameOf(LedPattern pattern);
const char* nameOf(rt::ContactState state);
const char* nameOf(rt::StiffnessRule rule);
const char* nameOf(rt::Mode mode);
const char* nameOf(rt::Cause cause);

}  // namespace hapticd::daemon
