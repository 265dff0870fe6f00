// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "daemon/base/journal_entry.h"
#include "drivers/base/stop_signal.h"
#include "drivers/camera/camera.h"
#include "drivers/handle/handle.h"
#include "rt/base/words.h"

namespace hapticd::daemon {

/// A fault that can be injected; scripts name it by its word.
enum class Fault {
  lost_frames,       ///< every second frame of the camera is dropped
  frozen_camera,     ///< no more frames arrive
  garbage_depth,     ///< frames contain random values
  handle_muted,      ///< no more measurements of the handle arrive
  handle_unplugged,  ///< likewise, and the handle returns with a new session
  handle_leap,       ///< positions half a metre away
  nan_pose,          ///< positions that are not numbers
  late_ticks,        ///< every second tick takes 3 ms longer
  channel_overflow,  ///< nobody reads the ticks from their ring
};
constexpr auto wordsOf(Fault) {
  return rt::words<Fault>("lost_frames", "frozen_camera", "garbage_depth", "handle_muted", "handle_unplugged",
                          "handle_leap", "nan_pose", "late_ticks", "channel_overflow");
}
inline constexpr int kFaultCount = static_cast<int>(rt::enumeratorCount<Fault>());

/// When a fault starts, counted from the start of the box, and how long it lasts.
struct ScriptedFault {
  Fault fault;
  std::chrono::duration<double> begin;
  std::chrono::duration<double> duration;
};

/// Reads a script: lines of "BEGIN_S DURATION_S FAULT", `#` begins a comment.
/// Errors: a file that cannot be read, a line of another form (with its number).
base::Result<std::vector<ScriptedFault>> readFaultScript(const std::filesystem::path& file);

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
