// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>

namespace hapticd::daemon {

/// The number of page faults, minor and major, of a thread of this process since the thread started (proc(5),
/// `stat`). Nothing if there is no such thread or no /proc.
std::optional<std::uint64_t> pageFaultsOf(pid_t thread_id);

}  // namespace hapticd::daemon
