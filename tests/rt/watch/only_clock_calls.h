// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::test {

/// Makes the kernel end the process at every further system call of the calling thread except reading and
/// sleeping on the clock. Returns false if the kernel or a sandbox does not support this. Cannot be undone.
bool allowOnlyClockCalls();

}  // namespace hapticd::test
