// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// What a device measures, in its own frame.
struct DeviceReading {
  rt::Vec3 position_m;
  rt::Vec3 velocity_m_per_s;
  bool velocity_valid = false;  ///< false: hapticd estimates it from the positions
  std::uint32_t buttons = 0;
  bool calibrated = true;
  bool fault = false;
};

/// A haptic device, as the libraries of vendors offer one. Another device needs nothing but these two
/// functions. Thread: one.
class Device {
 public:
  virtual ~Device() = default;
  virtual DeviceReading read() = 0;
  /// The force on the hand from now on, newtons in the device's frame; always finite.
  virtual void setForce(const rt::Vec3& force_n) = 0;
};

/// A drivers::SimulatedHand in real time: between two readings it moves by the whole steps that
/// have passed, at most kMaxCatchUpNs.
class SimulatedDevice final : public Device {
 public:
  static constexpr std::int64_t kStepNs = 250'000;
  static constexpr std::int64_t kMaxCatchUpNs = 50'000'000;

  /// The settings are taken to be in the device's frame.
  explicit SimulatedDevice(const drivers::SimulatedHandleSettings& settings)
      : hand_(settings, static_cast<double>(kStepNs) * 1e-9) {}

  DeviceReading read() override;
  void setForce(const rt::Vec3& force_n) override { force_n_ = force_n; }

 private:
  drivers::SimulatedHand hand_;
  rt::Vec3 force_n_;
  std::int64_t moved_to_ns_ = 0;
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
