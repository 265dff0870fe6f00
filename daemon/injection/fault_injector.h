// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/injection/fault_script.h"
#include "drivers/camera/camera.h"
#include "drivers/handle/handle.h"

namespace hapticd::daemon {

/// Injects the faults of a script where real ones enter: between the camera and the scene thread, between the
/// handle and the force loop, in the timing of the force loop, and at the control thread.
class FaultInjector {
 public:
  explicit FaultInjector(std::vector<ScriptedFault> script) : script_(std::move(script)) {}

  /// Starts the clock of the script.  Thread: the one that starts the box, once.
  void start();
  /// Whether a fault is active now.  Thread: any.  RT: safe.
  bool isOn(Fault fault) const noexcept;
  /// A warning for people with the active faults: "faults are injected: nan_pose".  Thread: any.
  std::string notice() const;

  /// Wraps `camera` and injects the faults of frames. The injector outlives it.
  std::unique_ptr<drivers::Camera> around(std::unique_ptr<drivers::Camera> camera);
  /// Wraps `handle` and injects the faults of measurements; measurements are up to a millisecond late. The
  /// injector outlives it.
  std::unique_ptr<drivers::Handle> around(std::unique_ptr<drivers::Handle> handle);

 private:
  std::vector<ScriptedFault> script_;
  std::atomic<std::int64_t> start_ns_{0};
};

}  // namespace hapticd::daemon
