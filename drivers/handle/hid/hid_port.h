// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "config/error.h"
#include "config/hid_id.h"

namespace hapticd::drivers {

/// An open HID device.  Thread: one.
class HidPort {
 public:
  virtual ~HidPort() = default;

  /// Waits for an input report, at most `wait`, and puts it into `buffer`, with its id first if it has one.
  /// Its length; 0 if none came.  Errors: the device is gone.
  virtual config::Result<std::size_t> read(std::span<std::uint8_t> buffer,
                                           std::chrono::milliseconds wait) = 0;

  /// Sends an output report that has no id. A device that does not take it may hold the call for seconds.
  /// Errors: the device is gone or does not take it.
  virtual config::Result<void> write(std::span<const std::uint8_t> report) = 0;
};

/// Which device is wanted.
struct HidSelection {
  config::HidId id;
  std::uint16_t usage_page = 0;
  std::uint16_t usage = 0;
  std::string serial;  ///< empty: the first one found
};

struct OpenedHid {
  std::unique_ptr<HidPort> port;
  std::string serial;  ///< empty if it has none
  std::string advice;  ///< for people: that there was a choice; may be empty
};

/// Finds and opens a device.  Errors: none is there, it may not be opened.
using HidOpener = std::function<config::Result<OpenedHid>(const HidSelection&)>;

}  // namespace hapticd::drivers
