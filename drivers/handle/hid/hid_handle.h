// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <thread>

#include "config/settings.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"
#include "drivers/handle/hid/hid_port.h"
#include "drivers/handle/hid/hid_worker.h"

namespace hapticd::drivers {

/// A handle on USB HID: a controller with the reports of reports.md, or a SpaceMouse, which exerts no force.
/// A device that is absent or lost is looked for twice a second.
///
/// stop() waits for the thread at most kStopLimit, because the kernel may hold an output report that a dying
/// device does not take for seconds; then the thread is left behind with what it still needs, touches the
/// channels no more, and ends when the kernel gives up.
class HidHandle final : public Handle {
 public:
  static constexpr std::chrono::milliseconds kStopLimit{1000};

  /// `open` finds and opens devices.
  HidHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale, HidOpener open,
            const HandleThreadPolicy& policy = {})
      : settings_(settings), scale_(scale), open_(std::move(open)), policy_(policy) {}
  ~HidHandle() override { stop(); }

  /// Errors: hid_handle.device names no device, it is running already, no thread can be had.
  config::Result<void> start(HandleChannels& channels) override;
  void stop() override;
  HandleStatus status() const override;

 private:
  config::HandleSettings settings_;
  rt::HandleScaleParameters scale_;
  HidOpener open_;
  HandleThreadPolicy policy_;
  mutable std::mutex worker_mutex_;
  std::shared_ptr<HidWorker> worker_;  // kept after stop(), for status()
  HandleScheduling scheduling_;
  std::thread thread_;
};

}  // namespace hapticd::drivers
