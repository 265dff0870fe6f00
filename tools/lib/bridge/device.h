// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// What a device measures, in its own frame.
struct DeviceReading {
  rt::Vec3 position_m;
  rt::Vec3 velocity_m_per_s;
  bool velocity_valid = false;  ///< false: hapticd estimates it from the positions
  std::uint32_t buttons = 0;    ///< bit n: button n is pressed
  bool calibrated = true;
  bool fault = false;
  std::optional<rt::Quaternion> orientation = {};  ///< unit; maps vectors of the tool to the device's frame
  std::optional<double> gripper_rad = {};          ///< opening angle of the gripper; 0: closed
  /// What the device adds to the delay from a motion to the force that responds to it, beyond the bridge's
  /// loop: threads, filters and services between this reading and the motors.
  std::int64_t latency_ns = 0;
};

/// What a device is to exert on the hand, in its own frame; always finite and within the device's limits.
struct DeviceCommand {
  rt::Vec3 force_n;
  rt::Vec3 torque_n_m;         ///< about the handle's point; ignored by a device without driven wrist
  double gripper_force_n = 0;  ///< > 0 opens; ignored by a device without driven gripper
};

/// Largest magnitudes that a device exerts; 0: it does not drive that.
struct DeviceLimits {
  double force_n = 0;
  double torque_n_m = 0;
  double gripper_force_n = 0;
};

/// A haptic device, as the libraries of vendors offer one. Thread: one. Neither function blocks: whatever
/// does belongs into a thread of the device.
class Device {
 public:
  virtual ~Device() = default;
  virtual DeviceReading read() = 0;
  /// What is exerted from now on.
  virtual void exert(const DeviceCommand& command) = 0;
  /// Of the device that is there now; known once it was opened.
  virtual DeviceLimits limits() const = 0;
};

inline constexpr std::int64_t kDeadManNs = 20'000'000;

/// The share of the commanded force that may be exerted when the newest valid command arrived `age_ns` ago:
/// all of it for 10 ms, none after 20 ms, and a falling share in between, so that the
/// force fades when a network stalls.
/// RT: safe.
constexpr double deadManShare(std::int64_t age_ns) {
  constexpr std::int64_t kFullNs = kDeadManNs / 2;
  if (age_ns <= kFullNs) return 1;
  if (age_ns >= kDeadManNs) return 0;
  return static_cast<double>(kDeadManNs - age_ns) / static_cast<double>(kDeadManNs - kFullNs);
}

/// Returns `force_n` with damping against the velocity along it, as in section 7 of
/// drivers/handle/udp/protocol.md: the force is never reversed, and zero stays zero. `damping_n_s_per_m`: >=
/// 0. RT: safe.
inline rt::Vec3 dampedForce(const rt::Vec3& force_n, const rt::Vec3& velocity_m_per_s,
                            double damping_n_s_per_m) {
  const double length_n = norm(force_n);
  if (!(length_n > 0)) return force_n;
  const rt::Vec3 along = (1 / length_n) * force_n;
  return std::max(0.0, length_n - damping_n_s_per_m * dot(velocity_m_per_s, along)) * along;
}

/// `force_n` cut to a length of at most `most_n`: the last limit before a person, so that a force or
/// limit that is not a number or infinite gives no force.
/// RT: safe.
inline rt::Vec3 boundedForce(const rt::Vec3& force_n, double most_n) {
  const double length_n = norm(force_n);
  if (!std::isfinite(length_n) || !std::isfinite(most_n) || most_n <= 0) return {};
  return length_n > most_n ? most_n / length_n * force_n : force_n;
}

}  // namespace hapticd::tools
