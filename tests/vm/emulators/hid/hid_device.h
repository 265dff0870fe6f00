// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::test::hid {

using Bytes = std::vector<std::uint8_t>;

/// The description of a device that the kernel gets.
struct Identity {
  std::string name;
  std::string serial;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  Bytes descriptor;  ///< of the reports
};

/// The firmware of a HID device, without its connection. Times are CLOCK_MONOTONIC.  Thread: one.
class HidDevice {
 public:
  virtual ~HidDevice() = default;
  virtual const Identity& identity() const = 0;
  /// Advances the device by a millisecond; returns the input report to send, if there is one.
  virtual std::optional<Bytes> tick(std::int64_t now_ns) = 0;
  /// Processes an output report, without an id.
  virtual void take(std::span<const std::uint8_t> report, std::int64_t now_ns) = 0;
  /// Executes a command; returns "ok", or "error: " and the reason.
  virtual std::string command(std::string_view line) = 0;
  /// Returns statistics as members of a JSON object, without its braces.
  virtual std::string stats(std::int64_t now_ns) const = 0;
};

}  // namespace hapticd::test::hid
