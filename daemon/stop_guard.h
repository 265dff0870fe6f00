// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "rt/loop/stop_bound.h"

namespace hapticd::daemon {

/// How long each part of the box may take to stop, in the order in which they stop. A part that takes longer
/// hangs in a library or on a disk, and the process ends without it.
struct StopLimits {
  /// rt::StopBound::kMax_s, with a reserve for a busy machine.
  static constexpr std::chrono::seconds kForceThread{7};
  static constexpr std::chrono::seconds kHandle{4};
  static constexpr std::chrono::seconds kTraces{8};
  static constexpr std::chrono::seconds kLeds{2};
  static constexpr std::chrono::seconds kCamera{4};
  static constexpr std::chrono::seconds kSceneThread{2};
  /// The sum of all limits; TimeoutStopSec= of the unit is longer.
  static constexpr std::chrono::seconds kAll =
      kForceThread + kHandle + kTraces + kLeds + kCamera + kSceneThread;
};
static_assert(StopLimits::kForceThread > std::chrono::duration<double>(rt::StopBound::kMax_s));

/// Logs the name of the part that hangs, then ends the process at once with EX_SOFTWARE.
[[noreturn]] void endWithout(const std::string& part, std::chrono::milliseconds limit);

/// Calls `stop`. If that takes longer than `limit`, another thread calls `give_up` while `stop` still runs.
/// Thread: any.  Progress: blocking.
void stopWithin(
    const std::string& part, std::chrono::milliseconds limit, const std::function<void()>& stop,
    const std::function<void(const std::string&, std::chrono::milliseconds)>& give_up = endWithout);

}  // namespace hapticd::daemon
