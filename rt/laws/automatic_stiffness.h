// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <tuple>
#include <type_traits>

#include "rt/base/fields.h"
#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/words.h"
#include "rt/scene/surface_noise.h"

/// The stiffest surface that loop, device and camera allow (`force.stiffness_n_per_m: auto`).
namespace hapticd::rt {

/// What limits the stiffness k_s.
enum class StiffnessBound : std::uint8_t {
  configured,  ///< nothing: it is configured as a number
  ceiling,     ///< the configured ceiling of the automatic stiffness
  stability,   ///< the loop's lag (stiffness_limit.h)
  device,      ///< the device's continuous force
  noise,       ///< noise of the surface
  slew,        ///< the surface's change per frame against the slew limit
};
constexpr auto wordsOf(StiffnessBound) {
  return words<StiffnessBound>("configured", "ceiling", "stability", "device", "noise", "slew");
}

/// Largest penetration at which the device exerts its continuous force.
inline constexpr double kPenetration_m = 0.01;
/// Smallest difference in force that a person notices, as a share of the force (Weber fraction 7 to 10 %),
/// and the force of a typical contact.
inline constexpr double kNoticeable = 0.07;
inline constexpr double kTypicalForce_n = 1;
/// Stiffness until the noise of the surface is known.
inline constexpr double kModestStiffness_n_per_m = 200;
/// Fastest changes of the stiffness in effect, as a share of it.
inline constexpr double kStiffnessRise_per_s = 0.1;
inline constexpr double kStiffnessFall_per_s = 0.5;

/// The largest stiffness that each rule allows, in N/m in coordinates of the HIP; infinite: no limit, or not
/// known.
struct StiffnessRules {
  static constexpr double kNone = std::numeric_limits<double>::infinity();

  double ceiling_n_per_m = kNone;
  double stability_n_per_m = kNone;
  double device_n_per_m = kNone;
  double noise_n_per_m = kNone;  ///< noise times stiffness is a noticeable change of the typical force
  double slew_n_per_m = kNone;   ///< the change per frame takes a frame at the slew limit
  SurfaceNoise surface;          ///< that the last two are based on

  /// `stability_n_per_m`: see Tick::stiffness_limit_n_per_m.  RT: safe.
  static StiffnessRules of(const LiveParameters& parameters, const HandleScaleParameters& handle,
                           double stability_n_per_m, const SurfaceNoise& surface) noexcept;

  /// A rule and the largest stiffness that it allows.
  struct Limit {
    StiffnessBound bound;
    double n_per_m;
  };
  /// Returns the rule that allows least. While the noise is not known, its rule allows
  /// `without_noise_n_per_m`.  RT: safe.
  Limit least(double without_noise_n_per_m) const noexcept;
};
template <std::same_as<StiffnessRules> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{
      HAPTICD_FIELD(ceiling_n_per_m, "force.stiffness_ceiling_n_per_m"),
      HAPTICD_FIELD(stability_n_per_m, "Stable with the lag of the loop and the device"),
      HAPTICD_FIELD(device_n_per_m, "The continuous force of the device at a penetration of 10 mm"),
      HAPTICD_FIELD(noise_n_per_m,
                    "Noise of the surface changes a force of 1 N by no more than a person notices, 7 %"),
      HAPTICD_FIELD(slew_n_per_m,
                    "The change of the surface per frame takes no longer than a frame at the slew limit"),
      HAPTICD_FIELD(surface.step_m,
                    "Mean absolute change of the surface's distance per frame, metres; null: not known")
          .shownAs([](const auto& rules) { return ifPositive(rules.surface.step_m); }),
      HAPTICD_FIELD(surface.frames,
                    "Number of frames that the noise of the surface was measured on; 0: not known")
          .named("noiseFrames")};
}

/// The automatic stiffness: follows the rules slowly, downwards at any time and upwards only without contact.
/// Thread: one.  RT: safe.
class AutomaticStiffness {
 public:
  /// Returns the stiffness k_s in effect at this tick: the configured one, or the automatic one if that is
  /// on. Called once at the beginning of each tick. `loaded_n`: force that is exerted with the stiffness;
  /// while it is, a changed one is approached as slowly as a surface that grows by kMaxGrowth_m_per_s.
  double begin(const LiveParameters& configured, double loaded_n = 0, double period_s = 0) HAPTICD_RT;

  /// Moves the automatic stiffness for the next tick, `period_s` after the one before. Called when the law
  /// has been evaluated. `in_contact`: the surface or a forbidden region holds the HIP.
  void follow(const StiffnessRules& rules, bool in_contact, double period_s) HAPTICD_RT;

  bool on() const noexcept { return on_; }
  double stiffness_n_per_m() const noexcept { return stiffness_n_per_m_; }
  /// Returns the rule that binds, also while the stiffness is still on its way to what that allows.
  StiffnessBound bound() const noexcept { return on_ ? bound_ : StiffnessBound::configured; }
  /// Of the last tick that evaluated the law, also while the stiffness is configured.
  const StiffnessRules& rules() const noexcept { return rules_; }

 private:
  bool on_ = false;
  double stiffness_n_per_m_ = 0;  ///< 0: no tick yet
  StiffnessBound bound_ = StiffnessBound::ceiling;
  StiffnessRules rules_;
};

}  // namespace hapticd::rt
