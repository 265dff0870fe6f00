// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "rt/base/vec3.h"

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

/// Angles of the driven joints, as their motors turn, radians. Waist: from the middle, > 0 to the person's
/// right. Shoulder: of the upper arm above level. Elbow: of the forearm from hanging straight down, > 0
/// towards the person; it does not change when the shoulder turns, because its motor sits in the base.
using JointAngles = PerJoint<double>;

inline constexpr double kUpperArm_m = 0.135;
inline constexpr double kForearm_m = 0.135;

/// The angles while the stylus is docked.
inline constexpr JointAngles kDockedAngles_rad{0, 0.23, -0.37};

/// The centre of the wrist, where the three axes of the gimbal meet and where forces act. Frame of the
/// handle: x to the right, y up, z towards the person; its origin is near the middle of the workspace.
rt::Vec3 wristAt(const JointAngles& angles_rad);

/// The wrist's velocity for a unit velocity of each joint, m/rad.
PerJoint<rt::Vec3> jacobianAt(const JointAngles& angles_rad);

/// The torques of the joints, in N m, that exert `force_n` at the wrist.
PerJoint<double> jointTorques(const JointAngles& angles_rad, const rt::Vec3& force_n);

/// The command that exerts `force_n` at these angles. A force that a motor cannot exert is shortened in its
/// own direction.
OmniCommand commandFor(const JointAngles& angles_rad, const PerJoint<double>& n_m_per_count,
                       const rt::Vec3& force_n);

/// Finds out what the encoders, which begin to count anywhere, show while the stylus is docked. Thread: one.
class Homing {
 public:
  static constexpr std::int64_t kStill_ns = 500'000'000;

  /// The joints' angles; nothing until the stylus was docked, with the arm still, for kStill_ns.
  std::optional<JointAngles> anglesAt(const OmniReading& reading, std::int64_t measured_ns);

 private:
  void look(const OmniReading& reading, std::int64_t measured_ns);

  bool known_ = false;
  PerJoint<std::int16_t> docked_{};          // what the encoders show there
  std::optional<std::int64_t> still_since_;  // at docked_
};

}  // namespace hapticd::tools::phantom_omni
