// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/handle/falcon/falcon_kinematics.h"

namespace hapticd::drivers {

/// Frames of 16 bytes exchanged with a Falcon's firmware: '<', 14 bytes of 0x41 + value, '>'. Numbers are
/// signed 16 bit in four nibbles, least significant first (libnifalcon, FalconFirmwareNovintSDK.cpp).
/// Thread: one per object.  RT: safe.

inline constexpr std::size_t kFalconFrameBytes = 16;
using FalconFrame = std::array<std::uint8_t, kFalconFrameBytes>;

/// Largest number of counts that the firmware accepts for a motor.
inline constexpr int kMaxMotorCounts = 4095;

/// Colours as named by VRPN and ros_falcon; libnifalcon's header has them in another order.
enum class FalconLed : std::uint8_t { off = 0, green = 0x02, blue = 0x04, red = 0x08 };

/// A frame sent to the device.
struct FalconOrder {
  FalconCounts motor_counts{};  ///< clamped to +-kMaxMotorCounts
  FalconLed led = FalconLed::off;
  bool home = false;  ///< request a report of which encoders are homed
};

/// A frame received from the device.
struct FalconReply {
  FalconCounts encoder_counts{};  ///< signed 16 bit; relative until homed
  std::uint8_t buttons = 0;       ///< bits: plus, forward, centre, minus
  std::uint8_t homed = 0;         ///< bit k: encoder k is homed; valid while requested
};

/// Value of FalconReply::homed when all encoders are homed.
inline constexpr std::uint8_t kAllHomed = 0x7;

/// Encodes an order.
FalconFrame frameOf(const FalconOrder& order);

/// Decodes a reply; nothing if the frame is damaged.
std::optional<FalconReply> replyIn(const FalconFrame& frame);

/// Extracts replies from a stream of bytes that may have lost, damaged or inserted bytes. Where a frame
/// cannot continue it resynchronises at the next '<', so that a broken frame does not cost the following one.
class FalconReplyStream {
 public:
  /// Adds a byte; returns the reply that it completes.
  std::optional<FalconReply> add(std::uint8_t byte);
  /// Discards a partial frame.
  void reset();
  /// Returns how often invalid data was received.
  std::uint64_t damaged() const { return damaged_; }

 private:
  void resynchronise();

  FalconFrame frame_{};
  std::size_t length_ = 0;
  bool in_step_ = true;  // the last byte belonged to a frame
  std::uint64_t damaged_ = 0;
};

/// Removes the two modem status bytes with which an FTDI chip begins each USB packet of at most 64 bytes.
/// `transfer`: one bulk transfer; its payload is moved to the front. Returns the number of payload bytes.
std::size_t removeStatusBytes(std::span<std::uint8_t> transfer);

}  // namespace hapticd::drivers
