// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/loop/loop_state.h"

namespace hapticd::config {

/// The cause of a mode in words for people; empty if the mode says all.
const char* textOf(rt::Cause cause);
/// The same where the mode is known: a lost camera does not mean that no force acts.
const char* textOf(rt::Mode mode, rt::Cause cause);

}  // namespace hapticd::config
