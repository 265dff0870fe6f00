// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "config/base/error.h"

struct libusb_context;
struct libusb_device_handle;

namespace hapticd::drivers {

/// Connection to the FTDI chip in a Falcon, from open() to the destructor: bytes in both directions and the
/// settings of its serial line. Each call ends within its time limit or within kRequestLimit.
/// Errors: of every call: the device is gone, or USB does not work.
/// Thread: always the same one.  RT: not safe.
class FtdiPort {
 public:
  /// Time limit of a control request.
  static constexpr std::chrono::milliseconds kRequestLimit{250};

  /// Divisors of the baud rates in use.
  enum class Baud : std::uint16_t { of_firmware = 0x0002, of_bootloader = 0x4138, of_image = 0x0015 };

  /// Opens the Falcon with this serial number, or the first one if it is empty, and detaches the kernel's
  /// serial driver.
  /// Errors: none found, no permission, in use.
  static base::Result<std::unique_ptr<FtdiPort>> open(const std::string& serial);

  ~FtdiPort();
  FtdiPort(const FtdiPort&) = delete;
  FtdiPort& operator=(const FtdiPort&) = delete;

  /// Returns the serial number; empty if the device does not report it.
  const std::string& serial() const { return serial_; }

  /// Discards pending bytes in both directions.
  base::Result<void> purge();
  /// Sets how long the chip collects bytes before it sends them: 1..255 ms.
  base::Result<void> setLatency(std::uint16_t latency_ms);
  base::Result<void> setBaud(Baud baud);
  /// Sets eight bits, no parity, one stop bit, no flow control.
  base::Result<void> setPlainFormat();
  base::Result<void> setRts(bool high);
  base::Result<void> setDtr(bool high);

  /// Sends `bytes`.  Errors: also if not all of them could be sent within `limit`.
  base::Result<void> write(std::span<const std::uint8_t> bytes, std::chrono::milliseconds limit);

  /// Returns received bytes, waiting up to `limit`; empty if there are none. They are valid until the next
  /// call.
  base::Result<std::span<const std::uint8_t>> read(std::chrono::milliseconds limit);

 private:
  static constexpr std::size_t kReadBytes = 512;  // whole packets, more than the chip buffers

  FtdiPort() = default;
  base::Result<void> initialise(const std::string& serial);
  base::Result<void> claim();
  base::Result<void> request(std::uint8_t request, std::uint16_t value, const char* what);

  libusb_context* context_ = nullptr;
  libusb_device_handle* device_ = nullptr;
  bool claimed_ = false;
  std::string serial_;
  std::uint8_t received_[kReadBytes];
};

}  // namespace hapticd::drivers
