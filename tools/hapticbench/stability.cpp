// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tools/hapticbench/engine/laws.h"

namespace hapticd::tools {

double ruleLimit_n_per_m(const DeviceAndHand& system, const SampledSpring& spring) {
  return (system.viscosity_n_s_per_m() + spring.damping_n_s_per_m) /
         (spring.period_s * (0.5 + spring.delay_ticks));
}

double spectralRadius(const DeviceAndHand& system, const SampledSpring& spring) {
  // the state: position, velocity, the previous position, and the delayed forces, the newest first
  const drivers::HeldStep step = drivers::heldStep(system, spring.period_s);
  const int delay = spring.delay_ticks;
  Eigen::MatrixXd loop = Eigen::MatrixXd::Zero(3 + delay, 3 + delay);
  for (int row = 0; row < 2; ++row) {
    loop(row, 0) = step.transition[static_cast<std::size_t>(2 * row)];
    loop(row, 1) = step.transition[static_cast<std::size_t>(2 * row + 1)];
  }
  loop(2, 0) = 1;
  Eigen::RowVectorXd force = Eigen::RowVectorXd::Zero(3 + delay);
  force(0) = -spring.stiffness_n_per_m - spring.damping_n_s_per_m / spring.period_s;
  force(2) = spring.damping_n_s_per_m / spring.period_s;
  Eigen::RowVectorXd applied = force;
  if (delay > 0) {
    loop.row(3) = force;
    for (int age = 1; age < delay; ++age) loop(3 + age, 2 + age) = 1;
    applied.setZero();
    applied(2 + delay) = 1;
  }
  loop.row(0) += step.input[0] * applied;
  loop.row(1) += step.input[1] * applied;
  return Eigen::EigenSolver<Eigen::MatrixXd>(loop, false).eigenvalues().cwiseAbs().maxCoeff();
}

double eigenvalueLimit_n_per_m(const DeviceAndHand& system, SampledSpring spring) {
  const auto stable = [&](double stiffness_n_per_m) {
    spring.stiffness_n_per_m = stiffness_n_per_m;
    return spectralRadius(system, spring) < 1;
  };
  constexpr double kMax_n_per_m = 1e7;
  double low = 1;
  if (!stable(low)) return 0;
  double high = low * 1.1;
  for (; stable(high); high *= 1.1) {
    if (high > kMax_n_per_m) return std::numeric_limits<double>::infinity();
    low = high;
  }
  while (high - low > 1e-6 * low) {
    const double middle = (low + high) / 2;
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

namespace {

constexpr double kPress_m = 0.0075;  // of the hand's target behind the onset
constexpr double kPreload_m =
    0.004;  // of a device that nobody holds; 500 N/m then are half the shipped limit
constexpr double kTapSpeed_m_per_s = 0.1;
constexpr double kMinSwing_m = 3e-5;
constexpr double kMaxSearched = 20;  // times the eigenvalue limit

DeviceAndHand systemOf(const LoopCase& loop) {
  return {.mass_kg = loop.device.mass_kg,
          .damping_n_s_per_m = loop.device.damping_n_s_per_m,
          .coulomb_friction_n = loop.device.coulomb_friction_n,
          .hand_stiffness_n_per_m = loop.grip.stiffness_n_per_m,
          .hand_damping_n_s_per_m = loop.grip.damping_n_s_per_m,
          .hand_mass_kg = loop.grip.mass_kg};
}

SampledSpring springOf(const LoopCase& loop) {
  return {.period_s = kTick_s, .delay_ticks = loop.delay_ticks};
}

/// -dF/dh between two positions, both approached from free space.
double slope_n_per_m(Wall& wall, double outer_m, double inner_m) {
  wall.approach(outer_m);
  const double outer_n = wall.force_n(outer_m, 0);
  const double inner_n = wall.force_n(inner_m, 0);
  return (inner_n - outer_n) / (outer_m - inner_m);
}

/// The static force around a position, from a slow push inwards.
class StaticCurve {
 public:
  StaticCurve(Wall& wall, double middle_m, double reach_m) : reach_m_(reach_m) {
    wall.approach(middle_m + reach_m);
    for (int i = 0; i <= 2 * kHalf; ++i) {
      forces_n_.push_back(wall.force_n(middle_m + reach_m * (1 - static_cast<double>(i) / kHalf), 0));
    }
  }

  /// The stiffness of the spring that a sine of that amplitude around the middle meets in the mean: the
  /// describing function, (1 / (pi a)) times the integral of F(a sin t) sin t over a turn.
  double equivalent_n_per_m(double amplitude_m) const {
    constexpr int kSamples = 200;
    double sum_n = 0;
    for (int i = 0; i < kSamples; ++i) {
      const double sine = std::sin(2 * std::numbers::pi * (i + 0.5) / kSamples);
      sum_n += force_n(-amplitude_m * sine) * sine;
    }
    return 2 * sum_n / (kSamples * amplitude_m);
  }

 private:
  static constexpr int kHalf = 200;

  double force_n(double outwards_m) const {
    const double place = std::clamp((1 - outwards_m / reach_m_) * kHalf, 0.0, 2 * kHalf - 1e-9);
    const auto before = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(before);
    return (1 - share) * forces_n_[before] + share * forces_n_[before + 1];
  }

  double reach_m_;
  std::vector<double> forces_n_;
};

/// The effective stiffness around the position where the motion came to rest. `wall` is set to
/// limit.found_n_per_m.
void measureFelt(Wall& wall, const ContactRun& rest, LoopLimit& limit) {
  const double set_n_per_m = limit.found_n_per_m;
  const double motion_m = std::max(rest.peak_to_peak_m / 2, 1e-4);
  limit.rest_h_m = rest.mean_m;
  limit.rendered_by_set = slope_n_per_m(wall, rest.mean_m + motion_m, rest.mean_m - motion_m) / set_n_per_m;
  const double tap_m = kTapSpeed_m_per_s * std::sqrt(systemOf(limit.loop).inertia_kg() / set_n_per_m);
  const double largest_m = std::max({motion_m, 2 * tap_m, wall.onset_m() - rest.mean_m, 0.0005});
  const StaticCurve curve(wall, rest.mean_m, largest_m);
  limit.softest_by_set = limit.stiffest_by_set = limit.rendered_by_set;
  for (double amplitude_m = kMinSwing_m; amplitude_m <= largest_m; amplitude_m *= 1.1) {
    const double equivalent = curve.equivalent_n_per_m(amplitude_m) / set_n_per_m;
    limit.softest_by_set = std::min(limit.softest_by_set, equivalent);
    limit.stiffest_by_set = std::max(limit.stiffest_by_set, equivalent);
  }
}

/// Potential of the static force: what a slow push from free space inwards takes.
class StaticPotential {
 public:
  explicit StaticPotential(Wall& wall) : outermost_m_(wall.onset_m()) {
    wall.approach(outermost_m_);
    double before_n = wall.force_n(outermost_m_, 0);
    energies_j_.push_back(0);
    for (int i = 1; i <= kSteps; ++i) {
      const double force_n = wall.force_n(outermost_m_ - i * kStep_m, 0);
      energies_j_.push_back(energies_j_.back() + (before_n + force_n) / 2 * kStep_m);
      before_n = force_n;
    }
  }

  /// Beyond the measured range, returns the value at its end.
  double energy_j(double h_m) const {
    const double place = std::clamp((outermost_m_ - h_m) / kStep_m, 0.0, kSteps - 1e-9);
    const auto before = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(before);
    return (1 - share) * energies_j_[before] + share * energies_j_[before + 1];
  }

 private:
  static constexpr double kStep_m = 1e-4;
  static constexpr int kSteps = 900;  // 90 mm: through a spring law's reach on both sides of the plane

  double outermost_m_;
  std::vector<double> energies_j_;
};

bool pushesBeforeContact(const Wall& wall) {
  return wall.onset_m() > 0;
}

}  // namespace

const std::vector<Grip>& allGrips() {
  static const std::vector<Grip> all{{"released", 0, 0},
                                     {"light", 400, 4},
                                     {"damped", 400, 8},
                                     {"firm", 1000, 10},
                                     {"heavy", 1000, 10, 0.2}};
  return all;
}

const std::vector<DeviceKind>& allDevices() {
  static const std::vector<DeviceKind> all{{"45g", 0.045, 0.05, 0, 0},
                                           {"100g", 0.1, 0.05, 0, 0},
                                           {"45g-friction", 0.045, 0.05, 0.26, 55e-6},
                                           {"100g-friction", 0.1, 0.05, 0.26, 55e-6},
                                           {"45g-encoder", 0.045, 0.05, 0, 55e-6},
                                           {"100g-encoder", 0.1, 0.05, 0, 55e-6}};
  return all;
}

const std::vector<DeviceKind>& devicesOnSale() {
  static const std::vector<DeviceKind> all{{"touch", 0.045, 0.05, 0.26, 55e-6, 3.3, 400},
                                           {"omni", 0.045, 0.05, 0.26, 55e-6, 3.3, 700},
                                           {"omega", 0.045, 0.05, 0, 0, 12, 5000},
                                           {"inverse3", 0.045, 0.05, 0, 0, 10, 1000}};
  return all;
}

const std::vector<std::string>& allWalls() {
  static const std::vector<std::string> all{"reference", "nearest_springs", "smooth_springs", "proxy",
                                            "surface"};
  return all;
}

std::unique_ptr<Wall> makeWall(const std::string& name, CoreOutput output,
                               const rt::LiveParameters& parameters) {
  for (const rt::ForceLaw law : kAllLaws) {
    if (nameOf(law) == name) return std::make_unique<CoreWall>(law, parameters, output);
  }
  return std::make_unique<ReferenceWall>();
}

LargestStable largestStable(const std::function<bool(double)>& is_stable, double guess, double cap,
                            double tolerance) {
  constexpr double kStep = 1.1;  // small, as a law may be unstable in a band only
  double low = guess / 2;
  while (!is_stable(low)) {
    low /= 2;
    if (low < guess / 1000) return {};
  }
  double high = low * kStep;
  for (; is_stable(high); high *= kStep) {
    low = high;
    if (low >= cap) return {low, true};
  }
  while (high > low * (1 + tolerance)) {
    const double middle = std::sqrt(low * high);
    (is_stable(middle) ? low : high) = middle;
  }
  return {low, false};
}

Rig rigOf(const LoopCase& loop) {
  return {.system = systemOf(loop), .quantum_m = loop.device.quantum_m, .delay_ticks = loop.delay_ticks};
}

Tap tapOf(Wall& wall, const LoopCase& loop, double stiffness_n_per_m) {
  const double onset_m = wall.onset_m();
  if (loop.grip.stiffness_n_per_m > 0) {
    return {.start_m = onset_m, .speed_m_per_s = kTapSpeed_m_per_s, .hand_target_m = onset_m - kPress_m};
  }
  const double preload_m =
      loop.device.hasOwnLimits() ? loop.device.max_force_n / (2 * stiffness_n_per_m) : kPreload_m;
  const double rest_m = onset_m - preload_m;
  wall.approach(rest_m);
  // not so fast that the device leaves the wall
  const double natural_per_s = std::sqrt(stiffness_n_per_m / systemOf(loop).inertia_kg());
  return {.start_m = rest_m,
          .speed_m_per_s = std::min(kTapSpeed_m_per_s, preload_m / 2 * natural_per_s),
          .constant_n = -wall.force_n(rest_m, 0)};
}

LoopLimit findLimit(const LoopCase& loop) {
  const std::unique_ptr<Wall> wall = makeWall(loop.wall);
  LoopLimit limit;
  limit.loop = loop;
  limit.rule_n_per_m = ruleLimit_n_per_m(systemOf(loop), springOf(loop));
  limit.eigenvalue_n_per_m = eigenvalueLimit_n_per_m(systemOf(loop), springOf(loop));
  ContactRun last_stable;
  const auto is_stable = [&](double stiffness_n_per_m) {
    wall->set(stiffness_n_per_m, 0);
    const ContactRun run = runContact(*wall, rigOf(loop), tapOf(*wall, loop, stiffness_n_per_m));
    if (run.stable) last_stable = run;
    return run.stable;
  };
  const LargestStable found =
      largestStable(is_stable, limit.eigenvalue_n_per_m, kMaxSearched * limit.eigenvalue_n_per_m);
  limit.found_n_per_m = found.value;
  limit.capped = found.capped;
  if (found.value <= 0) return limit;
  wall->set(found.value, 0);
  measureFelt(*wall, last_stable, limit);
  return limit;
}

DefaultRun runDefaults(const LoopCase& loop) {
  rt::LiveParameters settings;
  if (loop.device.hasOwnLimits()) {
    settings.force.stiffness_n_per_m = loop.device.stiffness_n_per_m;
    settings.safety.max_force_n = loop.device.max_force_n;
    settings.safety.continuous_force_n = loop.device.max_force_n;
  }
  // a wall each: leaps from one to the next would count as energy that the force has given
  const auto new_wall = [&] {
    auto wall = makeWall(loop.wall, CoreOutput::command, settings);
    wall->reportDelay_s(loop.delay_ticks * kTick_s);
    return wall;
  };
  const StaticPotential potential(*new_wall());
  const Tap tap = tapOf(*new_wall(), loop, settings.force.stiffness_n_per_m);
  const std::unique_ptr<Wall> wall = new_wall();
  Rig rig = rigOf(loop);
  rig.as_driver = true;
  DefaultRun result{loop, runContact(*wall, rig, tap, [&](double h_m) { return potential.energy_j(h_m); })};
  result.stiffness_kept_n_per_m = wall->stiffnessKept_n_per_m();
  result.popped_through = pushesBeforeContact(*wall) && result.run.deepest_m < 0;
  return result;
}

}  // namespace hapticd::tools
