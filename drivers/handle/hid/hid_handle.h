// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "config/base/error.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"
#include "drivers/handle/hid/hid_settings.h"

namespace hapticd::drivers {

/// An open HID device.  Thread: one.
class HidPort {
 public:
  virtual ~HidPort() = default;

  /// Waits for an input report for at most `wait` and copies it to `buffer`, preceded by its id if it has
  /// one. Returns its length, or 0 if none arrived.  Errors: the device is gone.
  virtual base::Result<std::size_t> read(std::span<std::uint8_t> buffer, std::chrono::milliseconds wait) = 0;

  /// Sends an output report without an id. A device that does not accept it may block the call for seconds.
  /// Errors: the device is gone or does not accept the report.
  virtual base::Result<void> write(std::span<const std::uint8_t> report) = 0;
};

/// Identifies the requested device.
struct HidSelection {
  HidId id;
  std::uint16_t usage_page = 0;
  std::uint16_t usage = 0;
  std::string serial;  ///< empty: the first one found
};

/// An opened device and what was found out about it.
struct OpenedHid {
  std::unique_ptr<HidPort> port;
  std::string serial;  ///< empty if it has none
  std::string advice;  ///< for people, e.g. that several devices match; may be empty
};

/// Finds and opens a device.  Errors: there is none, or it may not be opened.
using HidOpener = std::function<base::Result<OpenedHid>(const HidSelection&)>;

/// A HidOpener that uses hidapi's hidraw backend. It enumerates all HID devices, which takes milliseconds.
/// Thread: always the same one, also used for the port.  RT: not safe.
base::Result<OpenedHid> openThroughHidapi(const HidSelection& selection);

/// A handle on USB HID: a controller that uses the reports of reports.md, or a SpaceMouse, which exerts no
/// force.
///
/// stop() waits at most a second for the thread, because the kernel may block for seconds on an output
/// report that a failing device does not accept. The thread is then abandoned together with the data it still
/// needs; it no longer accesses the channels and ends when the kernel gives up.
/// Errors of check() and start(): hid_handle.device names no device.
class HidHandle final : public WorkerHandle {
 public:
  /// `open`: finds and opens devices.
  HidHandle(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale, HidOpener open,
            const HandleThreadPolicy& policy = {});
};

std::unique_ptr<Handle> makeHidHandle(const config::HandleSettings& settings,
                                      const rt::HandleScaleParameters& scale,
                                      const HandleThreadPolicy& policy);

}  // namespace hapticd::drivers
