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

/// Makes up the faults of a script, at the borders where real ones come in: between the camera and the scene
/// thread, between the handle and the force loop, in the force loop's time, at the control thread.
class FaultInjector {
 public:
  explicit FaultInjector(std::vector<ScriptedFault> script) : script_(std::move(script)) {}

  /// Time counts from here.  Thread: the one that starts the box, once.
  void start();
  /// Whether that fault is on now.  Thread: any.  RT: safe.
  bool isOn(Fault fault) const noexcept;
  /// "faults are injected: nan_pose", for people.  Thread: any.
  std::string notice() const;

  /// `camera` with the faults of frames. The injector outlives it.
  std::unique_ptr<drivers::Camera> around(std::unique_ptr<drivers::Camera> camera);
  /// `handle` with the faults of measurements; they come up to a millisecond later. The injector outlives it.
  std::unique_ptr<drivers::Handle> around(std::unique_ptr<drivers::Handle> handle);

 private:
  std::vector<ScriptedFault> script_;
  std::atomic<std::int64_t> start_ns_{0};
};

}  // namespace hapticd::daemon
