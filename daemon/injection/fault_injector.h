// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "daemon/injection/fault_script.h"
#include "drivers/base/stop_signal.h"
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

class FaultInjector;

/// Wraps a camera, and drops, stops or corrupts its frames on their way to the scene thread.
class FaultyCamera final : public drivers::Camera, private drivers::FrameSink {
 public:
  FaultyCamera(std::unique_ptr<drivers::Camera> camera, const FaultInjector& faults)
      : camera_(std::move(camera)), faults_(faults) {}

  base::Result<void> start(drivers::FrameSink& sink) override;
  void stop() override { camera_->stop(); }
  drivers::CameraStatus status() const override { return camera_->status(); }

 private:
  rt::DepthFrame& back() override { return sink_->back(); }
  void publish() override;

  std::unique_ptr<drivers::Camera> camera_;
  const FaultInjector& faults_;
  drivers::FrameSink* sink_ = nullptr;
  std::uint64_t frames_ = 0;
  std::minstd_rand random_;
};

class FaultInjector;

/// Wraps a handle, and stops its measurements, makes them leap or replaces them by NaN on their way to the
/// force loop. Commands always reach the device, which shows how the force loop reacts to the fault.
class FaultyHandle final : public drivers::Handle {
 public:
  FaultyHandle(std::unique_ptr<drivers::Handle> handle, const FaultInjector& faults)
      : handle_(std::move(handle)), faults_(faults) {}
  ~FaultyHandle() override { stop(); }

  base::Result<void> start(drivers::HandleChannels& channels) override;
  /// Passes the force loop's last command on before it stops, as without faults.
  void stop() override;
  drivers::HandleStatus status() const override { return handle_->status(); }

 private:
  void relay(drivers::HandleChannels& outer);
  rt::HandleCommand asAnsweredTo(rt::HandleCommand command) const;
  void pass(const rt::HandleState& measured, drivers::HandleChannels& outer);

  std::unique_ptr<drivers::Handle> handle_;
  const FaultInjector& faults_;
  drivers::HandleChannels inner_;
  drivers::StopSignal stop_;
  std::thread thread_;
  std::uint64_t replugs_ = 0;
  bool unplugged_ = false;
};

}  // namespace hapticd::daemon
