// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "config/error.h"

struct libusb_context;
struct libusb_device_handle;

namespace hapticd::drivers {

/// The FTDI chip in a Falcon, from open() to the destructor: bytes out, bytes in, and the settings of its
/// serial line. Each call ends within its time limit, or within kRequestLimit. Thread: all of it in one
/// thread.  RT: not safe. Errors: of every call: the device is gone, or USB does not work.
class FtdiPort {
 public:
  static constexpr std::chrono::milliseconds kRequestLimit{250};

  /// What the chip sends its serial line at.
  enum class Baud : std::uint16_t { of_firmware = 0x0002, of_bootloader = 0x4138, of_image = 0x0015 };

  /// Opens the Falcon with that serial number, or the first one if it is empty; takes it from the kernel's
  /// driver for serial ports.
  /// Errors: none found, no permission, in use.
  static config::Result<std::unique_ptr<FtdiPort>> open(const std::string& serial);

  ~FtdiPort();
  FtdiPort(const FtdiPort&) = delete;
  FtdiPort& operator=(const FtdiPort&) = delete;

  /// Empty when the device does not tell.
  const std::string& serial() const { return serial_; }

  /// Forgets what is under way in both directions.
  config::Result<void> purge();
  /// How long the chip collects bytes before it sends them: 1..255 ms.
  config::Result<void> setLatency(std::uint16_t latency_ms);
  config::Result<void> setBaud(Baud baud);
  /// Eight bits, no parity, one stop bit, no flow control.
  config::Result<void> setPlainFormat();
  config::Result<void> setRts(bool high);
  config::Result<void> setDtr(bool high);

  /// Errors: also when not all bytes could be sent within `limit`.
  config::Result<void> write(std::span<const std::uint8_t> bytes, std::chrono::milliseconds limit);

  /// What has arrived, or arrives next; nothing where the chip has nothing yet or `limit` is over. The bytes
  /// are valid until the next call.
  config::Result<std::span<const std::uint8_t>> read(std::chrono::milliseconds limit);

 private:
  static constexpr std::size_t kReadBytes = 512;  // whole packets, more than the chip holds

  FtdiPort() = default;
  config::Result<void> initialise(const std::string& serial);
  config::Result<void> claim();
  config::Result<void> request(std::uint8_t request, std::uint16_t value, const char* what);

  libusb_context* context_ = nullptr;
  libusb_device_handle* device_ = nullptr;
  bool claimed_ = false;
  std::string serial_;
  std::uint8_t received_[kReadBytes];
};

}  // namespace hapticd::drivers
