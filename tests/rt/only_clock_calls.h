// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::test {

/// From now on the kernel ends the process at every system call of the calling thread but reading and
/// sleeping on the clock. False where the kernel or a sandbox does not offer that. Cannot be taken back.
bool allowOnlyClockCalls();

}  // namespace hapticd::test
