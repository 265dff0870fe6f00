// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace hapticd::tools::phantom_omni {

/// One value for each driven joint: waist, shoulder, elbow.
template <typename Value>
using PerJoint = std::array<Value, 3>;
inline constexpr std::size_t kWaist = 0;
inline constexpr std::size_t kShoulder = 1;
inline constexpr std::size_t kElbow = 2;

/// The device sends and receives one packet in each isochronous cycle.
inline constexpr std::int64_t kCycle_ns = 125'000;

/// Largest number of counts of a motor's converter above or below the one without torque.
inline constexpr int kMostCounts = 2047;

/// What the device measures.
struct OmniReading {
  PerJoint<std::int16_t> encoders{};  ///< they wrap around
  std::uint32_t buttons = 0;          ///< bit n: button n is pressed
  bool docked = false;                ///< the stylus is in the inkwell
  std::uint32_t counter = 0;          ///< of packets
};

/// The light at the inkwell.
enum class DockLight : std::uint16_t { off = 0, slow_flash = 1, fast_flash = 2, steady = 3 };

/// What the device is to do in the cycle of a packet.
struct OmniCommand {
  PerJoint<int> counts{};  ///< of the motors, 0: no torque
  bool motors_on = false;
  DockLight light = DockLight::off;

  friend bool operator==(const OmniCommand&, const OmniCommand&) = default;
};

inline constexpr std::size_t kReadingBytes = 44;  ///< that are used; zeros may follow
inline constexpr std::size_t kMostReadingBytes = 0x40;
inline constexpr std::size_t kCommandBytes = 16;

/// Nothing: these are no bytes of an Omni.
std::optional<OmniReading> readingIn(std::span<const unsigned char> bytes);

/// The packet of a command; counts are cut to kMostCounts, and are zero while the motors are off.
std::array<unsigned char, kCommandBytes> bytesOf(const OmniCommand& command);

}  // namespace hapticd::tools::phantom_omni
