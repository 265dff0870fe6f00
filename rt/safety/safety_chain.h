// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/safety/force_limit.h"
#include "rt/safety/passivity.h"

namespace hapticd::rt {

/// Bounds the energy that a force of unknown origin gives to the hand: to a reserve, which a power fills
/// again, and what the hand gave to the force. So a passive spring behind the force is not limited, and one
/// that is unstable moves the hand with no more than the power.
///
/// A tick decides by a velocity that its force will change, and a command acts later than it was given, so
/// the budget can be overdrawn. A force whose budget is overdrawn by the reserve is zero.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class EnergyBudget {
 public:
  static constexpr double kReserve_j = 0.02;
  /// Of what the hand gave, this much is kept: the energy of a spring of 500 N/m under 10 N.
  static constexpr double kMost_j = 0.1;

  /// Accounts for the work of the force that acted on the hand during the last tick.
  /// `motion_m`: displacement of the hand meanwhile. `power_w` >= 0, `period_s` > 0.
  void follow(const Vec3& acted_n, const Vec3& motion_m, double power_w, double period_s) HAPTICD_RT {
    const double work_j = dot(acted_n, motion_m);
    if (std::isfinite(work_j)) left_j_ = std::min(left_j_ - work_j, kMost_j);
    if (left_j_ < kReserve_j) left_j_ = std::min(left_j_ + power_w * period_s, kReserve_j);
  }

  /// Returns the force without that part along the velocity of the hand which would give out in less than
  /// kSpending_s what is left, and less of it all where the budget is overdrawn. `force_n`: finite.
  Vec3 limited(const Vec3& force_n, const Vec3& velocity_m_per_s) const HAPTICD_RT {
    const Vec3 force = std::clamp(1 + left_j_ / kReserve_j, 0.0, 1.0) * force_n;
    const double speed2 = dot(velocity_m_per_s, velocity_m_per_s);
    const double excess_w = dot(force, velocity_m_per_s) - std::max(0.0, left_j_) / kSpending_s;
    if (!(excess_w > 0) || !(speed2 > 0)) return force;
    return force - (excess_w / speed2) * velocity_m_per_s;
  }

 private:
  /// Short enough that a full reserve lets a power of several watts pass, long beside a tick.
  static constexpr double kSpending_s = 0.004;

  double left_j_ = kReserve_j;
};

/// Remembers the most recent force commands and determines which one acts on the hand now: that commanded
/// one handle delay ago.
/// Thread: one.  Progress: wait-free.  RT: safe.
class CommandHistory {
 public:
  /// Number of ticks remembered, 127 ms at 1 kHz. A longer delay is treated as this one.
  static constexpr std::size_t kMaxTicks = 127;

  /// Appends the command of the current tick, in newtons.
  void add(const Vec3& command_n) HAPTICD_RT {
    newest_ = (newest_ + 1) % commands_n_.size();
    commands_n_[newest_] = command_n;
  }

  /// Returns the force that acted on the hand during the last tick; between two commands it interpolates
  /// linearly. `delay_s` >= 0; `period_s` > 0.
  Vec3 acting_n(double delay_s, double period_s) const HAPTICD_RT {
    const double ticks = ticksOf(delay_s, period_s);
    const auto whole = static_cast<std::size_t>(ticks);
    const double share = ticks - static_cast<double>(whole);
    return share > 0 ? (1 - share) * ago(whole) + share * ago(whole + 1) : ago(whole);
  }

  /// Returns the magnitude of the largest command that acted during the last tick or has not reached the hand
  /// yet.
  double largest_n(double delay_s, double period_s) const HAPTICD_RT {
    const auto ticks = static_cast<std::size_t>(std::ceil(ticksOf(delay_s, period_s)));
    double largest2_n2 = 0;
    for (std::size_t age = 0; age <= ticks; ++age)
      largest2_n2 = std::max(largest2_n2, dot(ago(age), ago(age)));
    return std::sqrt(largest2_n2);
  }

 private:
  static double ticksOf(double delay_s, double period_s) HAPTICD_RT {
    const double ticks = delay_s / period_s;
    return ticks > 0 ? std::min(ticks, static_cast<double>(kMaxTicks)) : 0;  // also if NaN
  }
  const Vec3& ago(std::size_t ticks) const HAPTICD_RT {
    return commands_n_[(newest_ + commands_n_.size() - ticks) % commands_n_.size()];
  }

  std::array<Vec3, kMaxTicks + 1> commands_n_;
  std::size_t newest_ = 0;
};

/// Stages that every force passes from the law to the device, after the scene blend. Their order is fixed:
/// passivity control, low-pass, palpation cue and external force, slew limit, magnitude clamp (peak and
/// thermal), finite check.
///
/// An external force is kept out of the balance of passivity control, which knows what the springs of the box
/// store, and has an energy budget of its own.
///
/// For any input, the output is finite, no longer than the magnitude limit, and differs from the previous
/// output by no more than the slew limit allows. A release reaches zero in kReleaseTicks equal steps, which
/// may be larger. A force above a lowered magnitude limit shrinks at the slew rate until it is within the
/// limit.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class SafetyChain {
 public:
  /// Number of ticks after which a released force is zero.
  static constexpr int kReleaseTicks = 3;

  /// Motion of hand and scene since the previous tick; the defaults apply where it is unknown.
  struct Motion {
    Vec3 hand_m;                   ///< displacement of the hand, in world axes
    Vec3 velocity_m_per_s;         ///< velocity of the hand
    double surface_work_j = 0;     ///< see Passivity::Input
    double stiffness_n_per_m = 0;  ///< of the law at the hand; 0: it stores no energy
    double device_damping_n_s_per_m = 0;
    double max_surface_speed_m_per_s = 0;
    double delay_s = 0;                  ///< from a motion of the hand to the force that responds to it
    double max_damping_n_s_per_m = 1e9;  ///< at the hand; limit for damping with this delay
    bool known = false;                  ///< the hand's motion was measured
    double motion_s = 0;                 ///< see Passivity::Input
    Vec3 cue_n_in_world{};               ///< palpation cue, added after the low-pass
    Vec3 external_n_in_world{};          ///< external force at the hand, added there too
    double stored_j = 0;                 ///< see Passivity::Input
  };

  /// Forces after each stage, in newtons at the hand, and which stages acted.
  struct Output {
    Vec3 passive_n_in_world;   ///< after passivity control
    Vec3 filtered_n_in_world;  ///< after the low-pass
    Vec3 slewed_n_in_world;    ///< after the slew limit
    Vec3 force_n_in_world;     ///< after clamp and finite check
    bool slew_limited = false;
    bool magnitude_clamped = false;
    bool not_finite = false;  ///< the input was not finite; the aim is zero instead
    bool passivity_acted = false;
    bool thermally_limited = false;  ///< the allowed force is below the maximum
  };

  /// Passes a force through the stages. `period_s`: time since the previous call, > 0.
  Output apply(const Vec3& force_n_in_world, const SafetyParameters& parameters, double period_s,
               const Motion& motion) HAPTICD_RT;
  Output apply(const Vec3& force_n_in_world, const SafetyParameters& parameters, double period_s) HAPTICD_RT {
    return apply(force_n_in_world, parameters, period_s, {});
  }

  /// Called instead of apply() to reach zero in kReleaseTicks equal steps, starting from the last output of
  /// apply(). The stages before the slew limit receive zero.
  Output release(const SafetyParameters& parameters, double period_s) HAPTICD_RT;

  /// Called before apply() or release() where the device has exerted no force for a while, whatever was
  /// commanded last: the next output starts from zero.
  void restart() HAPTICD_RT;

  /// Returns the last output; initially zero.
  const Vec3& lastForce_n_in_world() const noexcept { return last_; }
  double energy_j() const noexcept { return passivity_.energy_j(); }

 private:
  /// Returns as much of the external force as its limits allow.
  Vec3 allowedExternal_n(const SafetyParameters& parameters, double period_s,
                         const Motion& motion) HAPTICD_RT;
  /// `own_n`: the part of the force that is not external.
  void command(const Vec3& force_n, const Vec3& own_n, const SafetyParameters& parameters,
               double period_s) HAPTICD_RT;

  Passivity passivity_;
  LowPass low_pass_;
  ThermalLimit thermal_;
  EnergyBudget external_budget_;
  CommandHistory commands_;           // without the external part
  CommandHistory external_commands_;  // the external part alone
  Vec3 last_;
  Vec3 last_own_;  // its part that is not external
  Vec3 release_step_;
  Vec3 own_release_step_;
  int release_ticks_left_ = 0;
  bool releasing_ = false;
};

}  // namespace hapticd::rt
