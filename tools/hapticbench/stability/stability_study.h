// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/hapticbench/stability/contact_run.h"

namespace hapticd::tools {

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
};

auto fieldsOf(Is<Grip> auto& grip) {
  auto& [name, stiffness, damping, mass] = grip;
  return std::tie(name, stiffness, damping, mass);
}
auto fieldsOf(Is<DeviceKind> auto& device) {
  auto& [name, mass, damping, friction, quantum] = device;
  return std::tie(name, mass, damping, friction, quantum);
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
/// The names of the walls: `reference` and the laws of the core.
const std::vector<std::string>& allWalls();
/// `name`: one of allWalls().
std::unique_ptr<Wall> makeWall(const std::string& name, CoreOutput output = CoreOutput::law);

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
  ContactRun beyond{};         ///< at 1.2 times `found`
  /// found / eigenvalue limit.
  double ratio() const { return found_n_per_m / eigenvalue_n_per_m; }
  /// The stiffness rendered where it rests at the limit / eigenvalue limit.
  double renderedRatio() const { return rendered_by_set * found_n_per_m / eigenvalue_n_per_m; }
};
auto fieldsOf(Is<LoopLimit> auto& limit) {
  auto& [loop, rule, eigenvalue, found, capped, rest, rendered, softest, stiffest, beyond] = limit;
  return std::tie(loop, rule, eigenvalue, found, capped, rest, rendered, softest, stiffest, beyond);
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
/// Without one: a constant force holds the device 4 mm behind the onset and a push sets it swinging there.
/// `wall` is set to `stiffness_n_per_m` already.
Tap tapOf(Wall& wall, const LoopCase& loop, double stiffness_n_per_m);

LoopLimit findLimit(const LoopCase& loop);

/// A law with the shipped settings and the whole safety chain, on a device whose driver reports its delay and
/// estimates its velocity.
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
inline constexpr double kMostGiven_j = 0.01;
DefaultRun runDefaults(const LoopCase& loop);

}  // namespace hapticd::tools
