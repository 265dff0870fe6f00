// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/handle/falcon/falcon_kinematics.h"

namespace hapticd::drivers {

/// The 16-byte frames that a Falcon's firmware exchanges: '<', 14 bytes of 0x41 + value, '>'. Numbers are
/// signed 16 bit in four nibbles, the least significant first (libnifalcon, FalconFirmwareNovintSDK.cpp).
/// Thread: one per object.  RT: safe.

inline constexpr std::size_t kFalconFrameBytes = 16;
using FalconFrame = std::array<std::uint8_t, kFalconFrameBytes>;

/// The firmware takes at most this many counts for a motor.
inline constexpr int kMostMotorCounts = 4095;

/// Colours as VRPN and ros_falcon name them; the header of libnifalcon has them in another order.
enum class FalconLed : std::uint8_t { off = 0, green = 0x02, blue = 0x04, red = 0x08 };

struct FalconOrder {
  FalconCounts motor_counts{};  ///< each within +-kMostMotorCounts; beyond, it is cut
  FalconLed led = FalconLed::off;
  bool home = false;  ///< report which encoders are homed
};

struct FalconReply {
  FalconCounts encoder_counts{};  ///< signed 16 bit; relative until homed
  std::uint8_t buttons = 0;       ///< bits: plus, forward, centre, minus
  std::uint8_t homed = 0;         ///< bit k: encoder k is homed; valid while homing is asked for
};

inline constexpr std::uint8_t kAllHomed = 0x7;

FalconFrame frameOf(const FalconOrder& order);

/// Nothing where the frame is damaged: its ends, or a nibble that is none.
std::optional<FalconReply> replyIn(const FalconFrame& frame);

/// The replies in a stream of bytes that may have lost, damaged or added bytes. Begins anew at the next '<'
/// wherever a frame cannot go on, so that a broken frame does not cost the one behind it.
class FalconReplyStream {
 public:
  /// Takes over a byte; the reply that it completes.
  std::optional<FalconReply> add(std::uint8_t byte);
  /// Gives up a frame that has begun.
  void reset();
  /// How often something came that was no reply.
  std::uint64_t damaged() const { return damaged_; }

 private:
  void beginAnew();

  FalconFrame frame_{};
  std::size_t length_ = 0;
  bool in_step_ = true;  // the newest byte belonged to a frame
  std::uint64_t damaged_ = 0;
};

/// Removes the two bytes of modem status with which an FTDI chip begins each USB packet of at most 64 bytes.
/// `transfer`: one bulk transfer; what it carries moves to its front. Returns the number of bytes carried.
std::size_t removeStatusBytes(std::span<std::uint8_t> transfer);

}  // namespace hapticd::drivers
