// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include "config/settings/settings.h"
#include "drivers/handle/handle_frame.h"
#include "tools/hapticbench/stability.h"

namespace hapticd::tools {
namespace {

constexpr double kPeriod_s = 0.001;
constexpr double kDistance_m = 1;
constexpr std::uint16_t kRaw = 1000;

/// 1/Z = 1.3 - 0.0003 d: steps of 0.3 mm at 1 m, and exactly 1 m at kRaw.
rt::DepthModelParameters fineDepthModel() {
  rt::DepthModelParameters model;
  model.a_per_m = -0.0003;
  model.b_per_m = 1.3;
  model.near_m = 0.8;
  model.far_m = 1.4;
  return model;
}

/// Off the lattice of points, near the optical axis.
rt::Vec3 hipAt(double h_m) {
  return {0.00037, -0.00052, h_m - kDistance_m};
}

bool pushesBeforeContact(rt::ForceLaw law) {
  return !rt::hasProxy(law);
}

}  // namespace

double ReferenceWall::force_n(double h_m, double velocity_m_per_s) {
  return h_m >= 0 ? 0 : std::max(0.0, -stiffness_ * h_m - damping_ * velocity_m_per_s);
}

CoreWall::CoreWall(rt::ForceLaw law, const rt::LiveParameters& parameters, CoreOutput output)
    : box_(fineDepthModel(), {}, {}), output_(output), frame_(std::make_unique<rt::DepthFrame>()) {
  std::fill(frame_->image().begin(), frame_->image().end(), kRaw);
  frame_->sequence = 1;
  box_.parameters() = parameters;
  box_.parameters().law = law;
  box_.parameters().safety.engage_ramp_s = 0;
  if (output == CoreOutput::law) {
    box_.parameters().safety.max_force_n = 1e6;
    box_.parameters().safety.max_slew_n_per_s = 1e9;
  }
  box_.show(*frame_);
}

void CoreWall::set(double stiffness_n_per_m, double damping_n_s_per_m) {
  box_.parameters().force.stiffness_n_per_m = stiffness_n_per_m;
  box_.parameters().contact.damping_n_s_per_m = damping_n_s_per_m;
}

void CoreWall::approach(double h_m) {
  constexpr double kFree_m = 0.06;
  constexpr double kStep_m = 0.0005;
  for (double free_m = kFree_m; free_m > h_m; free_m -= kStep_m) force_n(free_m, 0);
  force_n(h_m, 0);
}

double CoreWall::force_n(double h_m, double velocity_m_per_s) {
  const rt::Tick tick = box_.tick(hipAt(h_m), kPeriod_s, {0, 0, velocity_m_per_s}, delay_s_);
  stiffness_gain_ = tick.stiffness_gain;
  return (output_ == CoreOutput::law ? tick.law_force_n_in_world : tick.command_force_n_in_world).z;
}

double CoreWall::onset_m() const {
  const rt::LiveParameters& parameters = box_.parameters();
  return pushesBeforeContact(parameters.law) ? parameters.force.radius_m : 0;
}

namespace {

constexpr double kMin_s = 2;
constexpr double kMax_s = 32;
constexpr double kStill_m = 1e-4;
constexpr double kStillSteps = 3;
constexpr double kAway_m = 0.2;

struct Measured {
  double position_m = 0;
  double velocity_m_per_s = 0;
};

class Simulation {
 public:
  Simulation(Wall& wall, const Rig& rig, const Tap& tap, Potential potential_j = {})
      : wall_(wall),
        rig_(rig),
        tap_(tap),
        potential_j_(std::move(potential_j)),
        frame_(settingsOf(rig), {}),
        motion_(rig.system, kTick_s, rig.sub_steps) {
    wall_.approach(tap.start_m);
    motion_.place(tap.start_m, -tap.speed_m_per_s);
    measured_m_ = quantised(tap.start_m);
    under_way_.assign(static_cast<std::size_t>(rig.delay_ticks), wall_.force_n(measured_m_, 0));
    positions_m_.push_back(tap.start_m);
  }

  void runUntil(double end_s) {
    const auto ticks = static_cast<std::size_t>(std::llround(end_s / kTick_s));
    while (forces_n_.size() < ticks && !away_) tick();
  }

  ContactRun result() const {
    ContactRun run;
    const std::size_t end = positions_m_.size();
    const std::size_t quarter = end - end / 4;
    run.ran_away = away_;
    run.peak_to_peak_m = peakToPeak(positions_m_, quarter, end);
    const auto rest = std::span(positions_m_).subspan(quarter);
    run.mean_m = std::accumulate(rest.begin(), rest.end(), 0.0) / static_cast<double>(rest.size());
    addMostGiven(run);
    return run;
  }

  bool away() const { return away_; }
  bool rests(double peak_to_peak_m) const {
    return peak_to_peak_m < std::max(kStill_m, kStillSteps * rig_.quantum_m);
  }
  double quarter(std::size_t number) const {
    const std::size_t count = positions_m_.size();
    return peakToPeak(positions_m_, (number - 1) * count / 4, number * count / 4);
  }

 private:
  double quantised(double position_m) const {
    return rig_.quantum_m > 0 ? rig_.quantum_m * std::round(position_m / rig_.quantum_m) : position_m;
  }

  void tick() {
    const Measured measured = measure();
    under_way_.push_back(wall_.force_n(measured.position_m, measured.velocity_m_per_s));
    measured_m_ = measured.position_m;
    const double force_n = under_way_.front();
    under_way_.pop_front();
    motion_.advance(force_n, tap_.constant_n, tap_.hand_target_m);
    forces_n_.push_back(force_n);
    positions_m_.push_back(motion_.position_m());
    away_ = !(std::abs(motion_.position_m()) < kAway_m);
  }

  std::int64_t now_ns() const {
    constexpr std::int64_t kTick_ns = 1'000'000;
    return static_cast<std::int64_t>(forces_n_.size() + 1) * kTick_ns;
  }
  /// What the law gets of the device: as its driver makes it of what the device measures, or that itself.
  Measured measure() {
    const double position_m = quantised(motion_.position_m());
    if (!rig_.as_driver) return {position_m, (position_m - measured_m_) / kTick_s};
    const rt::HandleState state =
        frame_.stateOf({.position_m_in_handle = {position_m, 0, 0}, .time_ns = now_ns()});
    return {state.position_m_in_world.x, state.velocity_m_per_s_in_world.x};
  }
  static config::HandleSettings settingsOf(const Rig& rig) {
    config::HandleSettings settings;
    settings.position_step_m = rig.quantum_m;
    return settings;
  }

  void addMostGiven(ContactRun& run) const {
    const auto potential_j = [this](double h_m) { return potential_j_ ? potential_j_(h_m) : 0.0; };
    const double begin_j = potential_j(positions_m_.front());
    double given_j = 0;
    for (std::size_t i = 0; i < forces_n_.size(); ++i) {
      given_j += forces_n_[i] * (positions_m_[i + 1] - positions_m_[i]);
      run.most_given_j = std::max(run.most_given_j, given_j);
      run.most_above_potential_j =
          std::max(run.most_above_potential_j, given_j - begin_j + potential_j(positions_m_[i + 1]));
    }
    run.deepest_m = *std::min_element(positions_m_.begin(), positions_m_.end());
  }

  Wall& wall_;
  Rig rig_;
  Tap tap_;
  Potential potential_j_;
  drivers::HandleFrame frame_;
  drivers::Motion motion_;
  double measured_m_;
  std::deque<double> under_way_;     // forces, the oldest first
  std::vector<double> positions_m_;  // one more than forces
  std::vector<double> forces_n_;     // held from positions_m_[i] to [i + 1]
  bool away_ = false;
};

/// In that time a loop with 1 % of the system's damping left halves its motion, between the middles of the
/// second and the last quarter.
double longest_s(const DeviceAndHand& system) {
  const double rate = 0.01 * system.viscosity_n_s_per_m() / (2 * system.inertia_kg());
  return std::clamp(2 * std::numbers::ln2 / rate, kMin_s, kMax_s);
}

}  // namespace

double peakToPeak(const std::vector<double>& values, std::size_t first, std::size_t last) {
  const auto begin = values.begin();
  const auto [low, high] = std::minmax_element(begin + static_cast<std::ptrdiff_t>(first),
                                               begin + static_cast<std::ptrdiff_t>(last));
  return *high - *low;
}

ContactRun runContact(Wall& wall, const Rig& rig, const Tap& tap, const Potential& potential_j) {
  Simulation simulation(wall, rig, tap, potential_j);
  bool stable = false;
  for (double end_s = kMin_s;; end_s *= 2) {
    simulation.runUntil(end_s);
    if (simulation.away()) break;
    const double before_m = simulation.quarter(2);
    const double after_m = simulation.quarter(4);
    stable = simulation.rests(after_m) || after_m < before_m / 2;
    if (stable || after_m > 1.5 * before_m) break;
    if (end_s >= longest_s(rig.system)) {
      stable = after_m < 0.95 * before_m;
      break;
    }
  }
  ContactRun run = simulation.result();
  run.stable = stable;
  return run;
}

ContactRun runContactFor(Wall& wall, const Rig& rig, const Tap& tap, double seconds) {
  Simulation simulation(wall, rig, tap);
  simulation.runUntil(seconds);
  ContactRun run = simulation.result();
  run.stable = !simulation.away() &&
               (simulation.rests(run.peak_to_peak_m) || run.peak_to_peak_m < simulation.quarter(2) / 2);
  return run;
}

}  // namespace hapticd::tools
