// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>

#include "config/settings/settings.h"
#include "drivers/base/worker_thread.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"
#include "drivers/handle/hid/hid_port.h"
#include "drivers/handle/hid/hid_settings.h"
#include "drivers/handle/hid/hid_worker.h"

namespace hapticd::drivers {

/// A handle on USB HID: a controller that uses the reports of reports.md, or a SpaceMouse, which exerts no
/// force. While the device is absent or lost, the driver searches for it twice a second.
///
/// stop() waits at most kStopLimit for the thread, because the kernel may block for seconds on an output
/// report that a failing device does not accept. The thread is then abandoned together with the data it still
/// needs; it no longer accesses the channels and ends when the kernel gives up.
class HidHandle final : public Handle {
 public:
  static constexpr std::chrono::milliseconds kStopLimit{1000};

  /// `open` finds and opens devices.
  HidHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale, HidOpener open,
            const HandleThreadPolicy& policy = {})
      : settings_(settings), scale_(scale), open_(std::move(open)), policy_(policy) {}
  ~HidHandle() override { stop(); }

  /// Errors: hid_handle.device names no device, the driver is already running, no thread can be started.
  base::Result<void> check() const override;
  base::Result<void> start(HandleChannels& channels) override;
  void stop() override { thread_.stop(kStopLimit); }
  HandleStatus status() const override;

 private:
  config::HandleSettings settings_;
  rt::HandleScaleParameters scale_;
  HidOpener open_;
  HandleThreadPolicy policy_;
  std::atomic<HandleScheduling> scheduling_{HandleScheduling{}};
  WorkerThread<HidWorker> thread_;
};

std::unique_ptr<Handle> makeHidHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy);

}  // namespace hapticd::drivers
