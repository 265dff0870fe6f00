// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace hapticd::daemon {

/// Logs the name of the part that hangs, then ends the process at once with EX_SOFTWARE.
[[noreturn]] void endWithout(const std::string& part, std::chrono::milliseconds limit);

/// Calls `stop`. If that takes longer than `limit`, another thread calls `give_up` while `stop` still runs.
/// Thread: any.  Progress: blocking.
void stopWithin(
    const std::string& part, std::chrono::milliseconds limit, const std::function<void()>& stop,
    const std::function<void(const std::string&, std::chrono::milliseconds)>& give_up = endWithout);

}  // namespace hapticd::daemon
