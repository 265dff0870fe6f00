// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace hapticd::daemon {

/// Ends the process at once with EX_SOFTWARE, after a line in the journal that names the part that hangs.
[[noreturn]] void endWithout(const std::string& part, std::chrono::milliseconds limit);

/// Calls `stop`. Where it takes longer than `limit`, `give_up` is called from another thread while it goes
/// on. Thread: any.  Progress: blocking.
void stopWithin(
    const std::string& part, std::chrono::milliseconds limit, const std::function<void()>& stop,
    const std::function<void(const std::string&, std::chrono::milliseconds)>& give_up = endWithout);

}  // namespace hapticd::daemon
