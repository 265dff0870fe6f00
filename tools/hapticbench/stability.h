// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/parts/fields.h"

namespace hapticd::tools {

/// A wall that pushes back along one axis: h is the distance in front of the true surface, metres, negative
/// behind it; forces are along the outward normal, newtons. Thread: one.
class Wall {
 public:
  virtual ~Wall() = default;
  /// Stiffness that the wall is set to (k_s) and damping (B).
  virtual void set(double stiffness_n_per_m, double damping_n_s_per_m) = 0;
  /// Sets the delay that the driver of the device reports; initially 0.
  virtual void reportDelay_s(double) {}
  /// Brings the hand from free space to h as a person would, so that what the law remembers is right.
  virtual void approach(double h_m) = 0;
  /// Runs one tick of 1 ms and returns the force.
  virtual double force_n(double h_m, double velocity_m_per_s) = 0;
  /// The h from which on inwards there is a force: 0, or farther out for laws that push before contact.
  virtual double onset_m() const = 0;
  /// Returns the stiffness of the last force, which the core may have reduced.
  virtual double stiffnessKept_n_per_m() const = 0;
};

/// The one-sided spring and damper of the theory, which never pulls.
class ReferenceWall final : public Wall {
 public:
  void set(double stiffness_n_per_m, double damping_n_s_per_m) override {
    stiffness_ = stiffness_n_per_m;
    damping_ = damping_n_s_per_m;
  }
  void approach(double) override {}
  double force_n(double h_m, double velocity_m_per_s) override;
  double onset_m() const override { return 0; }
  double stiffnessKept_n_per_m() const override { return stiffness_; }

 private:
  double stiffness_ = 0;
  double damping_ = 0;
};

/// The force of the core that acts on the device.
enum class CoreOutput {
  law,      ///< the law's alone
  command,  ///< what a device gets: after blend, limits and checks
};

/// A law of the core on a fronto-parallel plane 1 m in front of the camera. Every pixel has the same raw
/// value and the depth model gives that value exactly 1 m, so the plane has neither noise nor steps.
class CoreWall final : public Wall {
 public:
  /// `parameters`: all but the law, the stiffness and the damping; its safety limits are lifted where
  /// `output` is the law's.
  CoreWall(rt::ForceLaw law, const rt::LiveParameters& parameters, CoreOutput output);

  void set(double stiffness_n_per_m, double damping_n_s_per_m) override;
  void reportDelay_s(double delay_s) override { delay_s_ = delay_s; }
  void approach(double h_m) override;
  double force_n(double h_m, double velocity_m_per_s) override;
  double onset_m() const override;
  /// Adds fixtures and tissue regions; null: none. They outlive the wall. The surface is at z = -1 m.
  void setAdditions(const rt::FixtureSet* fixtures, const rt::TissueMap* tissue) {
    box_.setAdditions(fixtures, tissue);
    if (fixtures == nullptr) return;
    for (std::uint32_t i = 0; i < fixtures->count; ++i) {
      double& clearance_m = box_.parameters().standoff_clearance_m;
      const rt::Fixture& fixture = fixtures->fixtures[i];
      if (fixture.kind == rt::FixtureKind::standoff) clearance_m = std::max(clearance_m, fixture.clearance_m);
    }
  }
  double stiffnessKept_n_per_m() const override {
    return stiffness_gain_ * box_.parameters().force.stiffness_n_per_m;
  }

 private:
  OfflineBox box_;
  CoreOutput output_;
  double delay_s_ = 0;
  double stiffness_gain_ = 1;
  std::unique_ptr<rt::DepthFrame> frame_;
};

using drivers::DeviceAndHand;

inline constexpr double kTick_s = 0.001;

/// A device in a hand in front of a wall. The wall sees the quantised position and the backward difference of
/// it as velocity, or what the drivers make of it; its force reaches the device `delay_ticks` later and is
/// then held for a tick.
struct Rig {
  DeviceAndHand system;
  double quantum_m = 0;  ///< of the measured position; 0: none
  int delay_ticks = 0;   ///< after the law, 0..100
  int sub_steps = 20;
  /// Position and velocity as drivers compute them (drivers::HandleFrame), with the shipped resolution;
  /// otherwise as the device measures them.
  bool as_driver = false;
};

/// How contact begins and what holds the device against the wall.
struct Tap {
  double start_m = 0;          ///< h
  double speed_m_per_s = 0.1;  ///< inwards
  double hand_target_m = 0;    ///< h; without effect where no hand holds the device
  double constant_n = 0;       ///< outwards; negative: presses the device against the wall
};

/// The outcome of a tap.
struct ContactRun {
  bool stable = false;
  bool ran_away = false;      ///< left the 0.2 m around the wall, or a number was not finite
  double peak_to_peak_m = 0;  ///< over the last quarter
  double mean_m = 0;          ///< over the last quarter
  /// Largest energy that the acting force had given to device and hand at any time since the beginning.
  double most_given_j = 0;
  double most_above_potential_j = 0;  ///< the same beyond what its potential had fallen by
  double deepest_m = 0;               ///< h
};
auto fieldsOf(Is<ContactRun> auto& run) {
  auto& [stable, ran_away, swing, mean, given, above, deepest] = run;
  return std::tie(stable, ran_away, swing, mean, given, above, deepest);
}

/// Potential energy of the wall's force at h, joules.
using Potential = std::function<double(double h_m)>;

/// Stable: within 2 s the peak-to-peak motion of the last quarter is at rest or below half that of the second
/// quarter. At rest: below 0.1 mm or, where the position is quantised, below three steps, within which no
/// reading is more than one step beside the middle one. Unstable: it is above 1.5 times. Between the two the
/// run is extended up to the time in which a loop that has only 1 % of its damping left would halve its
/// motion (32 s at most); then it is stable if the motion fell by 5 %. `potential_j`: for
/// most_above_potential_j; may be empty.
ContactRun runContact(Wall& wall, const Rig& rig, const Tap& tap, const Potential& potential_j = {});

/// Runs for `seconds`, without deciding about stability.
ContactRun runContactFor(Wall& wall, const Rig& rig, const Tap& tap, double seconds);

/// Returns the largest minus the smallest of the values [first, last).
double peakToPeak(const std::vector<double>& values, std::size_t first, std::size_t last);

/// A spring and damper computed once per period from the sampled position (the damper from the backward
/// difference), each value held for a period after `delay_ticks` periods.
struct SampledSpring {
  double stiffness_n_per_m = 500;  ///< K
  double damping_n_s_per_m = 0;    ///< B
  double period_s = 0.001;         ///< T
  int delay_ticks = 0;             ///< t_d = delay_ticks T
};

/// The rule (b + B) / (T/2 + t_d), newtons per metre, where b holds the hand's damping too.
/// Source: Colgate and Schenkel 1997 and its extension to delay, low-frequency limit.
double ruleLimit_n_per_m(const DeviceAndHand& system, const SampledSpring& spring);

/// Largest magnitude of an eigenvalue of the two-sided (never separating) linear loop; below 1: stable.
/// Coulomb friction is left out.
double spectralRadius(const DeviceAndHand& system, const SampledSpring& spring);

/// The stiffness up to which every smaller one (from 1 N/m on) is stable by spectralRadius(), to 1e-6 of it;
/// 0 where none is, `infinity` where all up to 1e7 N/m are. `spring.stiffness_n_per_m` is not read.
double eigenvalueLimit_n_per_m(const DeviceAndHand& system, SampledSpring spring);

/// Properties of a hand that holds the device.
struct Grip {
  std::string name;
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double mass_kg = 0;  ///< that moves with the device
};

/// A device as simulated.
struct DeviceKind {
  std::string name;
  double mass_kg = 0.045;
  double damping_n_s_per_m = 0.05;
  double coulomb_friction_n = 0;
  double quantum_m = 0;
  double max_force_n = 0;        ///< that it exerts, and that the box is set to; 0: the shipped limit
  double stiffness_n_per_m = 0;  ///< that it renders at most, and that the box is set to; 0: the shipped one

  bool hasOwnLimits() const { return max_force_n > 0; }
};

auto fieldsOf(Is<Grip> auto& grip) {
  auto& [name, stiffness, damping, mass] = grip;
  return std::tie(name, stiffness, damping, mass);
}
auto fieldsOf(Is<DeviceKind> auto& device) {
  auto& [name, mass, damping, friction, quantum, force, stiffness] = device;
  return std::tie(name, mass, damping, friction, quantum, force, stiffness);
}

inline const std::string& nameOf(const Grip& grip) {
  return grip.name;
}
inline const std::string& nameOf(const DeviceKind& device) {
  return device.name;
}

/// released, light, damped, firm, and heavy, which is firm with the mass of a hand: haptics.md's range of
/// hands.
const std::vector<Grip>& allGrips();
/// 45 and 100 g, each viscous only, with the Coulomb friction and the encoder of a desktop stylus, and with
/// the encoder alone.
const std::vector<DeviceKind>& allDevices();
/// Devices that can be bought, with their own limits. Force and stiffness: CHAI3D 3.3 (CPhantomDevices,
/// CDeltaDevices) and its fork for the Inverse3. The Touch has the friction and the encoder of a desktop
/// stylus. No mass, friction and encoder of the others is published: they are as light as hapticd assumes a
/// device to be, without friction.
const std::vector<DeviceKind>& devicesOnSale();
/// The names of the walls: `reference` and the laws of the core.
const std::vector<std::string>& allWalls();
/// `name`: one of allWalls(). `parameters`: as for CoreWall.
std::unique_ptr<Wall> makeWall(const std::string& name, CoreOutput output = CoreOutput::law,
                               const rt::LiveParameters& parameters = {});

/// One closed loop: which wall, device, hand and delay.
struct LoopCase {
  std::string wall;
  Grip grip;
  DeviceKind device;
  int delay_ticks = 0;
};
auto fieldsOf(Is<LoopCase> auto& loop) {
  auto& [wall, grip, device, delay_ticks] = loop;
  return std::tie(wall, grip, device, delay_ticks);
}

struct LoopLimit {
  LoopCase loop{};
  double rule_n_per_m = 0;        ///< (b + B) / (T/2 + t_d), with the hand's damping
  double eigenvalue_n_per_m = 0;  ///< of the two-sided linear loop
  double found_n_per_m = 0;       ///< largest stable stiffness that the law was set to
  bool capped = false;            ///< stable up to where the search ended
  double rest_h_m = 0;            ///< where the motion came to rest at `found`
  double rendered_by_set = 1;     ///< -dF/dh over the motion there, by the stiffness set
  double softest_by_set = 1;      ///< smallest and largest stiffness that swings of 0.03 mm up to the tap's
  double stiffest_by_set = 1;  ///< amplitude (0.5 mm at least) meet there in the mean, by the stiffness set
  /// found / eigenvalue limit.
  double ratio() const { return found_n_per_m / eigenvalue_n_per_m; }
  /// The stiffness rendered where it rests at the limit / eigenvalue limit.
  double renderedRatio() const { return rendered_by_set * found_n_per_m / eigenvalue_n_per_m; }
};
auto fieldsOf(Is<LoopLimit> auto& limit) {
  auto& [loop, rule, eigenvalue, found, capped, rest, rendered, softest, stiffest] = limit;
  return std::tie(loop, rule, eigenvalue, found, capped, rest, rendered, softest, stiffest);
}

/// The largest value that is stable together with all that were tried below it, to `tolerance` of it, and
/// whether `cap` was reached. Begins at `guess`/2 and goes up by factors of 1.1, or down by 2 to
/// `guess`/1000.
struct LargestStable {
  double value = 0;
  bool capped = false;
};
LargestStable largestStable(const std::function<bool(double)>& is_stable, double guess, double cap,
                            double tolerance = 0.02);

/// The rig of a case.
Rig rigOf(const LoopCase& loop);
/// With a hand: its target is 7.5 mm behind the wall's onset and the tap begins at the onset with 0.1 m/s.
/// Without one: a constant force of half the device's limit holds the device behind the onset, 4 mm for one
/// without own limits, and a push sets it swinging there.
/// `wall` is set to `stiffness_n_per_m` already.
Tap tapOf(Wall& wall, const LoopCase& loop, double stiffness_n_per_m);

LoopLimit findLimit(const LoopCase& loop);

/// A law with the shipped settings, or the device's own limits, and the whole safety chain, on a device whose
/// driver reports its delay and estimates its velocity.
struct DefaultRun {
  LoopCase loop{};
  ContactRun run{};
  double stiffness_kept_n_per_m = 0;
  /// The device reached the far side of the plane, where a spring law pushes in the opposite direction.
  bool popped_through = false;
};
auto fieldsOf(Is<DefaultRun> auto& shipped) {
  auto& [loop, run, kept, popped_through] = shipped;
  return std::tie(loop, run, kept, popped_through);
}
/// Largest energy that the shipped settings may give with the laws that have a proxy.
inline constexpr double kMaxGiven_j = 0.01;
DefaultRun runDefaults(const LoopCase& loop);

/// Why a limit differs from the theory, by measurement; empty where it is within 10 %, and beginning with
/// "NOT explained" where neither the effective stiffness nor friction (the same loop without it, which is
/// looked up in `limits`, being within 10 %) accounts for it.
std::string explanationOf(const LoopLimit& limit, const std::vector<LoopLimit>& limits);

}  // namespace hapticd::tools
