// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "config/settings/settings.h"
#include "drivers/base/status_board.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/hid/hid_controller.h"
#include "drivers/handle/hid/hid_port.h"
#include "drivers/handle/hid/hid_spacemouse.h"

namespace hapticd::drivers {

/// The driver's thread function and its state: searches for the device, exchanges reports with it, and
/// restarts when it is lost. Owned jointly by the thread and the driver, because a write blocked by a failing
/// device may outlive the driver; such a thread loses access to the channels.
class HidWorker {
 public:
  /// The settings must describe a device.
  HidWorker(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
            HidSelection selection, HidOpener open, HandleChannels& channels);

  /// Runs until requestStop().  Thread: the driver's own, which ends with it.
  void run();

  /// Asks run() to switch the motors off and to end; the channels are no longer accessed.
  /// Thread: any except the driver's own.
  void requestStop();

  /// Returns the current state.  Thread: any.
  HandleStatus status() const;

 private:
  using Clock = std::chrono::steady_clock;

  void useDeviceOnce();
  void reportMissing(const base::Error& error);
  base::Result<void> useController(HidPort& port);
  base::Result<bool> takeReports(HidPort& port);
  base::Result<void> write(HidPort& port, const Report& report);
  base::Result<void> useSpaceMouse(HidPort& port);
  template <typename Fill>
  void report(HandlePresence presence, Fill fill);
  bool publish(const rt::HandleState& state);
  rt::HandleCommand newestCommand();

  const bool is_spacemouse_;
  const HidSelection selection_;
  const HidOpener open_;
  StatusBoard<HandleStatus> board_;
  StopSignal stop_signal_;
  std::atomic<std::int64_t> writing_since_ns_{0};  // 0: not writing

  // accessed by run() only
  HidController controller_;
  HidSpaceMouse spacemouse_;
  bool seen_ = false;  // the device has been found before
  HandlePresence reported_ = HandlePresence::absent;
  std::int64_t reported_ns_ = 0;

  std::mutex mutex_;
  HandleChannels* channels_;  // null once taken away
};

}  // namespace hapticd::drivers
