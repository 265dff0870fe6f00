// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <numbers>

#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/safety/joint_stiffness.h"

/// Two rules that keep the loop of device, hand and delay stable: damping while in contact, and a limit of
/// the stiffness. Both follow from the loop's lag, which is the mean age of the position to which the acting
/// force responds.
namespace hapticd::rt {

/// Contact damping as a multiple of K times the lag, the negative damping that the lag adds to a spring. The
/// stability limit is 1; above 1 the loop is stable with a margin, above 2 the delayed damping itself reduces
/// stability.
inline constexpr double kContactDamping = 1.75;

/// The time in seconds by which the velocity that damping acts on lags behind the position: half of the
/// longest line of drivers::VelocityEstimator for a device at 1 kHz.
inline constexpr double kVelocityLag_s = 0.001;

/// Largest stiffness with delayed damping in units of m / lag^2, for a mass m, where kVelocityLag_s is small
/// beside the lag.
inline constexpr double kStiffnessOfMass = 0.35;

/// Share of the stability limit that stiffnessOfMass_n_per_m() uses at most.
inline constexpr double kShareOfStability = 0.88;

/// Largest total delayed damping in units of m / lag, for a mass m, where kVelocityLag_s is small beside the
/// lag.
inline constexpr double kDampingOfMass = 0.7;

/// Share of the stability limit that largestDamping_n_s_per_m() uses at most.
inline constexpr double kShareOfDamping = 0.6;

/// The rule that limits the stiffness.
enum class StiffnessRule : std::uint8_t {
  none,   ///< k_s is within the limit
  delay,  ///< damping of the device in the hand against the lag (largestStableStiffness_n_per_m)
  mass,   ///< the device's mass against the delayed damping (stiffnessOfMass_n_per_m)
};
constexpr auto wordsOf(StiffnessRule) {
  return words<StiffnessRule>("none", "delay", "mass");
}

/// Returns the time in seconds by which the force lags behind the hand: half a period, because the force is
/// held for a period; the handle's delay; and the delay of a first-order low-pass at low frequencies, 1 / (2
/// pi f). `period_s`: > 0; `delay_s`: below 0 counts as 0; `filter_hz`: 0: no low-pass.  RT: safe.
constexpr double loopLag_s(double period_s, double delay_s, double filter_hz) noexcept {
  const double filter_s = filter_hz > 0 ? 1 / (2 * std::numbers::pi * filter_hz) : 0;
  return period_s / 2 + std::max(0.0, delay_s) + filter_s;
}

/// Returns the stiffest spring in N/m that a sampled, delayed loop renders stably:  (b + B) / lag  (Gil et
/// al., Hulin; a linear device of damping b, small B). An eigenvalue sweep over 45 to 100 g, b of 0.05 to 1 N
/// s/m and up to 5 ms finds limits of 0.999 to 1.020 times this for B = 0, and 0.89 to 0.98 times for B = 2 N
/// s/m. `damping_n_s_per_m`: b, of the device in the hand, > 0; `wall_damping_n_s_per_m`: B, >= 0; `lag_s`: >
/// 0.  RT: safe.
constexpr double largestStableStiffness_n_per_m(double damping_n_s_per_m, double wall_damping_n_s_per_m,
                                                double lag_s) noexcept {
  return (damping_n_s_per_m + wall_damping_n_s_per_m) / lag_s;
}

/// Returns the contact damping in N s/m that keeps a spring stable on a device without any damping of its
/// own.  RT: safe.
constexpr double contactDamping_n_s_per_m(double stiffness_n_per_m, double lag_s) noexcept {
  return kContactDamping * stiffness_n_per_m * lag_s;
}

/// Returns the stiffness in N/m at which a mass, a spring and contactDamping_n_s_per_m() begin to oscillate
/// if the spring is delayed by `lag_s` and the damping by `velocity_lag_s` more: the limit of
///   m s^2 + (K + B s e^(-s velocity_lag)) e^(-s lag) = 0  with B = 1.75 K lag,
/// by a fit that is within 1.5 % of it for velocity_lag up to 2 lag.
/// `mass_kg`: > 0; `lag_s`: > 0; `velocity_lag_s`: >= 0.  RT: safe.
constexpr double oscillatingStiffness_n_per_m(double mass_kg, double lag_s, double velocity_lag_s) noexcept {
  return 0.55 * mass_kg /
         (lag_s * lag_s + 1.965 * lag_s * velocity_lag_s + 0.625 * velocity_lag_s * velocity_lag_s);
}

/// Returns the stiffest spring in N/m that stays stable with contactDamping_n_s_per_m(), with a margin, for
/// a velocity that lags by kVelocityLag_s.
/// `mass_kg`: of the device alone, > 0; a hand that holds it adds to it. `lag_s`: > 0.  RT: safe.
constexpr double stiffnessOfMass_n_per_m(double mass_kg, double lag_s) noexcept {
  return std::min(kStiffnessOfMass * mass_kg / (lag_s * lag_s),
                  kShareOfStability * oscillatingStiffness_n_per_m(mass_kg, lag_s, kVelocityLag_s));
}

/// Returns the largest total damping at the hand in N s/m that is stable with the delay `lag_s`, with a
/// margin. A damper alone, m s + B e^(-s (lag + velocity_lag)) = 0, reaches its limit at B = pi / 2 times
/// m / (lag + velocity_lag).  RT: safe.
constexpr double largestDamping_n_s_per_m(double mass_kg, double lag_s) noexcept {
  return std::min(kDampingOfMass * mass_kg / lag_s,
                  kShareOfDamping * std::numbers::pi / 2 * mass_kg / (lag_s + kVelocityLag_s));
}

/// Returns the part of the HIP's velocity that contact damping acts on. Motion along with a moving surface is
/// not opposed; a surface that moves by itself pushes through the spring only, so that a change of its
/// estimated velocity does not step the force.
/// RT: safe.
inline Vec3 velocityToDamp(const Vec3& hip_m_per_s, const Vec3& surface_m_per_s) noexcept {
  const double surface_speed = norm(surface_m_per_s);
  if (!(surface_speed > 0)) return hip_m_per_s;
  const Vec3 direction = (1 / surface_speed) * surface_m_per_s;
  const double along = dot(hip_m_per_s, direction);
  return hip_m_per_s - std::clamp(along, 0.0, surface_speed) * direction;
}

/// A contact as contact damping needs it.
struct DampedContact {
  Vec3 force_n;           ///< the law's force, after the scene blend
  Vec3 normal;            ///< unit normal out of the surface; zero: take the direction of the force
  Vec3 velocity_m_per_s;  ///< of the HIP, from velocityToDamp()
  /// Damping where the proxy does not follow the HIP across the normal, and where that is
  /// (ProxyGrip::across()).
  double across_n_s_per_m = 0;
  JointStiffness grip{};
};

/// Returns the contact force with damping `damping_n_s_per_m` (>= 0) along the normal, which never makes the
/// surface pull, and with that across it. RT: safe.
inline Vec3 damped(const DampedContact& contact, double damping_n_s_per_m) noexcept {
  const double length_n = norm(contact.force_n);
  if (!(length_n > 0)) return contact.force_n;
  const Vec3 normal = contact.normal == Vec3{} ? (1 / length_n) * contact.force_n : contact.normal;
  const double along_n = dot(contact.force_n, normal);
  if (!(along_n > 0)) return contact.force_n;
  const double pressed_n = std::max(0.0, along_n - damping_n_s_per_m * dot(contact.velocity_m_per_s, normal));
  return contact.force_n + (pressed_n - along_n) * normal +
         dampedAcross_n(contact.grip, contact.across_n_s_per_m, length_n, contact.velocity_m_per_s);
}

}  // namespace hapticd::rt
