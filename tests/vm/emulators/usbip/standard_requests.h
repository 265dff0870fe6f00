// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "tests/vm/emulators/usbip/usb_device.h"

namespace hapticd::test::usbip {

/// The requests that every device with one configuration answers in the same way. SET_ADDRESS is none of
/// them: vhci_hcd keeps it for itself.
class StandardRequests {
 public:
  explicit StandardRequests(UsbDevice& device) : device_(device) {}

  /// Returns the reply to a standard request; nothing if the request is the device's own.
  std::optional<ControlAnswer> answer(const SetupPacket& setup);
  /// Returns the configuration; 0 before the host has configured the device.
  std::uint8_t configuration() const { return configuration_; }

 private:
  ControlAnswer clearFeature(const SetupPacket& setup);
  std::optional<ControlAnswer> descriptor(const SetupPacket& setup) const;
  ControlAnswer setConfiguration(std::uint8_t value);

  UsbDevice& device_;
  std::uint8_t configuration_ = 0;
  std::array<std::uint8_t, 2> answer_{};
};

}  // namespace hapticd::test::usbip
