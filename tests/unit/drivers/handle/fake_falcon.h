// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace hapticd::test {

/// A simulated Novint Falcon at the level of its FTDI chip: control requests and bytes in both directions. It
/// has a bootloader and, after receiving an image of the right length, a firmware that replies to orders. The
/// encoders count from a random position until the grip has been at its outer and then at its inner end. A
/// test sets and reads the public data under `mutex`.
/// Thread: any.
class FakeFalcon {
 public:
  struct Request {
    int request;
    int value;
    bool operator==(const Request&) const = default;
  };
  using Counts = std::array<int, 3>;

  static constexpr const char* kSerial = "FALCON01";
  static constexpr Counts kOuterEnd{700, 700, 700};
  static constexpr Counts kInnerEnd{-700, -700, -700};
  /// Encoder counts in the damaged replies of a garbled device.
  static constexpr Counts kGarbledCounts{500, -300, 100};

  // set by a test
  bool plugged = true;
  bool may_be_opened = true;
  bool in_use = false;
  bool held_by_kernel = true;
  bool has_firmware = true;
  std::size_t image_bytes = 0;  // size of the running image
  int unanswered_greetings = 0;
  bool zero_before_greeting = false;
  int wrong_echoes = 0;  // number of images whose first byte is echoed wrongly
  bool mute = false;
  bool garbled = false;  // every second reply is damaged, each differently
  std::uint8_t buttons = 0;

  // read by a test
  bool detached = false;
  int openings = 0;
  std::vector<Request> requests;
  std::vector<std::uint8_t> image;
  std::uint64_t orders = 0;
  std::uint64_t damaged_replies = 0;
  std::uint64_t wrong_orders = 0;
  Counts motors{};
  int control = 0;  // LED and homing request of the newest order

  std::mutex mutex;

  /// Moves the grip.  Locks `mutex`.
  void moveTo(const Counts& counts);
  /// Simulates a power cycle: firmware and homing are lost.  Locks `mutex`.
  void loseEverything();

  // Functions of the chip for fake_falcon_libusb.cpp.  Each locks `mutex`.
  void take(Request request);
  void take(std::span<const std::uint8_t> bytes);
  /// Returns the next packet: two status bytes and a part of the pending data.
  std::size_t give(std::span<std::uint8_t> transfer);

 private:
  enum class Stage { idle, greeting, image_announced, image };

  void takeInBootloader(std::span<const std::uint8_t> bytes);
  void takeOrder(std::span<const std::uint8_t> bytes);
  void reply();
  void queueDamaged(std::array<std::uint8_t, 16> reply);
  void queue(std::span<const std::uint8_t> bytes);

  Counts counts_{};
  std::array<bool, 3> was_outside_{};
  std::array<bool, 3> homed_{};
  Stage stage_ = Stage::idle;
  int baud_ = 0;
  int latency_ms_ = 0;
  bool dtr_ = false;
  bool rts_ = true;
  bool plain_format_ = false;
  std::deque<std::uint8_t> pending_;
};

}  // namespace hapticd::test

/// Returns the only device on the fake bus.
extern "C" hapticd::test::FakeFalcon* hapticdFakeFalcon();
