// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace hapticd::rt {

class HapticCore;

/// Runs the core on a synthetic surface, from free space into contact, so that its code is in memory and the
/// vector instructions of this machine have been selected before the first tick. `point_capacity`: capacity
/// of the core.  RT: not safe.
void warmUp(HapticCore& core, std::size_t point_capacity);

}  // namespace hapticd::rt
