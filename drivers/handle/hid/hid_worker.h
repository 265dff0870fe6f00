// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "config/settings.h"
#include "drivers/base/status_board.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/hid/hid_controller.h"
#include "drivers/handle/hid/hid_port.h"
#include "drivers/handle/hid/hid_spacemouse.h"

namespace hapticd::drivers {

/// What the driver's thread does: look for the device, exchange reports with it, and begin again when it is
/// lost. The thread owns it together with the driver, because a write that a dying device holds may outlive
/// the driver; the channels are taken away from such a thread.
class HidWorker {
 public:
  /// The settings describe a device.
  HidWorker(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale,
            HidSelection wanted, HidOpener open, HandleChannels& channels);

  /// Thread: the driver's own, which ends with it.
  void run();

  /// Asks run() to switch the motors off and to end. False when it has not ended within `limit` and must be
  /// left behind. Either way the channels are not touched any more.
  /// Thread: any but the driver's own.
  bool stop(std::chrono::milliseconds limit);

  /// Thread: any.
  HandleStatus status() const;

 private:
  using Clock = std::chrono::steady_clock;

  void useDeviceOnce();
  void reportMissing(const config::Error& error);
  config::Result<void> useController(HidPort& port);
  config::Result<bool> takeReports(HidPort& port);
  config::Result<void> write(HidPort& port, const Report& report);
  config::Result<void> useSpaceMouse(HidPort& port);
  template <typename Fill>
  void report(HandlePresence presence, Fill fill);
  bool publish(const rt::HandleState& state);
  rt::HandleCommand newestCommand();

  const bool is_spacemouse_;
  const HidSelection wanted_;
  const HidOpener open_;
  StatusBoard<HandleStatus> board_;
  StopSignal stop_signal_;
  std::atomic<std::int64_t> writing_since_ns_{0};  // 0: not writing

  // run() only
  HidController controller_;
  HidSpaceMouse spacemouse_;
  bool seen_ = false;  // it was there once
  HandlePresence reported_ = HandlePresence::absent;
  std::int64_t reported_ns_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  HandleChannels* channels_;  // null once they are taken away
  bool ended_ = false;
};

}  // namespace hapticd::drivers
