// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>

#include "tools/hapticbench/engine/study.h"

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
  for (const rt::ForceLaw law : kAllOf<rt::ForceLaw>) {
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

namespace {

constexpr double kAllowed = 0.1;

constexpr const char* kStabilityExplanation =
    "Closed loop at 1 kHz, one axis, a plane 1 m away that faces the camera. rule: (b + B)/(T/2 + t_d)\n"
    "with the hand's damping in b; eigen: limit of the linear two-sided loop; found: largest stable k_s\n"
    "(2 %); ratio: found by eigen; rendered: -dF/dh where the motion rests, by k_s; softest,\n"
    "stiffest: what swings around that place meet.\n\n";

constexpr const char* kDefaultsExplanation =
    "\nShipped settings (500 N/m), or the device's own limits where it has some, with the whole safety "
    "chain;\n"
    "the delay is reported as a driver does.\n"
    "popped: passed through the plane; kept: stiffness that the core leaves; gives: most energy at the hand\n"
    "at any time; above potential: the same without what the spring had stored.\n\n";

bool isNear(double ratio) {
  return std::abs(ratio - 1) <= kAllowed;
}

/// Empty unless the theory's stiffness lies, within 10 %, among those that swings around the position of rest
/// meet.
std::string explainedByStiffness(const LoopLimit& limit) {
  if (isNear(limit.renderedRatio())) return fmt::format("rendered there: {:.2f} k_s", limit.rendered_by_set);
  const double needed = 1 / limit.ratio();
  if (needed < (1 - kAllowed) * limit.softest_by_set || needed > (1 + kAllowed) * limit.stiffest_by_set)
    return {};
  return fmt::format("rendered to swings there: {:.2f} to {:.2f} k_s", limit.softest_by_set,
                     limit.stiffest_by_set);
}

/// Returns the limit of the same loop with a device of that mass without Coulomb friction; null: not in
/// `limits`.
const LoopLimit* withoutFriction(const LoopLimit& limit, const std::vector<LoopLimit>& limits) {
  const auto is_it = [&limit](const LoopLimit& other) {
    return other.loop.wall == limit.loop.wall && other.loop.grip.name == limit.loop.grip.name &&
           other.loop.delay_ticks == limit.loop.delay_ticks && other.loop.device.coulomb_friction_n == 0 &&
           other.loop.device.mass_kg == limit.loop.device.mass_kg;
  };
  const auto found = std::find_if(limits.begin(), limits.end(), is_it);
  return found == limits.end() ? nullptr : &*found;
}

/// What identifies the loop, and `figures`.
Row cellsWith(const LoopCase& loop, const Row& figures) {
  return joined({{"/law", "law", 0, loop.wall},
                 {"/hand", "hand", 0, loop.grip.name},
                 {"/device", "device", 0, loop.device.name},
                 {"/delay_ticks", "t_d ms", 0, loop.delay_ticks}},
                figures);
}

/// `limits`: of all loops, which the explanation looks at.
Row limitCells(const LoopLimit& r, const std::vector<LoopLimit>& limits) {
  return cellsWith(r.loop, {{"/rule_n_per_m", "rule N/m", 0, r.rule_n_per_m},
                            {"/eigenvalue_n_per_m", "eigen N/m", 0, r.eigenvalue_n_per_m},
                            {"/found_n_per_m", "found N/m", 0, r.found_n_per_m},
                            {"/capped", "capped", 0, r.capped},
                            {"/ratio", "ratio", 3, r.ratio()},
                            {"/felt_by_set", "rendered", 3, r.rendered_by_set},
                            {"/softest_by_set", "softest", 3, r.softest_by_set},
                            {"/stiffest_by_set", "stiffest", 3, r.stiffest_by_set},
                            {"/explanation", "deviation", 0, explanationOf(r, limits)}});
}

Row defaultCells(const DefaultRun& r) {
  return cellsWith(r.loop,
                   {{"/stable", "stable", 0, r.run.stable},
                    {"/ran_away", "ran away", 0, r.run.ran_away},
                    {"/peak_to_peak_m", "mm p-p", 3, r.run.peak_to_peak_m, 1e3},
                    {"/most_given_j", "gives mJ", 2, r.run.most_given_j, 1e3},
                    {"/most_above_potential_j", "above potential mJ", 2, r.run.most_above_potential_j, 1e3},
                    {"/stiffness_kept_n_per_m", "kept N/m", 0, r.stiffness_kept_n_per_m},
                    {"/popped_through", "popped", 0, r.popped_through}});
}

/// The loops of one law and delay together, apart for each device with limits of its own.
struct DefaultsSummary {
  std::string law;
  std::string device;  ///< empty: all that have none
  int delay_ticks = 0;
  int all = 0, stable = 0, popped = 0, stable_without_pop = 0;
  double most_given_j = 0, most_above_potential_j = 0, least_kept_n_per_m = 1e9;
};

Row summaryCells(const DefaultsSummary& r) {
  return {{"", "law", 0, r.law},
          {"", "device", 0, r.device},
          {"", "t_d ms", 0, r.delay_ticks},
          {"", "loops", 0, r.all},
          {"", "stable", 0, r.stable},
          {"", "popped", 0, r.popped},
          {"", "stable of the others", 0, r.stable_without_pop},
          {"", "kept N/m", 0, r.least_kept_n_per_m},
          {"", "gives mJ", 2, r.most_given_j, 1e3},
          {"", "above potential mJ", 2, r.most_above_potential_j, 1e3}};
}

void addDefaults(const std::vector<DefaultRun>& runs, Report& report) {
  std::map<std::tuple<std::string, std::string, int>, DefaultsSummary> summaries;
  std::vector<DefaultRun> bad;
  for (const DefaultRun& run : runs) {
    const std::string device = run.loop.device.hasOwnLimits() ? run.loop.device.name : "";
    DefaultsSummary& sum = summaries[{run.loop.wall, device, run.loop.delay_ticks}];
    sum.law = run.loop.wall;
    sum.device = device;
    sum.delay_ticks = run.loop.delay_ticks;
    ++sum.all;
    sum.stable += run.run.stable ? 1 : 0;
    sum.popped += run.popped_through ? 1 : 0;
    sum.stable_without_pop += run.run.stable && !run.popped_through ? 1 : 0;
    sum.most_given_j = std::max(sum.most_given_j, run.run.most_given_j);
    sum.most_above_potential_j = std::max(sum.most_above_potential_j, run.run.most_above_potential_j);
    sum.least_kept_n_per_m = std::min(sum.least_kept_n_per_m, run.stiffness_kept_n_per_m);
    if (!run.run.stable || run.run.most_given_j > kMaxGiven_j) bad.push_back(run);
  }
  report.show("shipped settings", kDefaultsExplanation,
              rowsOf(summaries, [](const auto& of_key) { return summaryCells(of_key.second); }));
  const std::string title = fmt::format("unstable, or giving more than {:g} mJ", kMaxGiven_j * 1e3);
  report.show(title, "\n" + title + "\n", rowsOf(bad, defaultCells));
}

std::vector<DeviceKind> knownDevices() {
  std::vector<DeviceKind> devices = allDevices();
  devices.insert(devices.end(), devicesOnSale().begin(), devicesOnSale().end());
  return devices;
}

struct StabilityOptions {
  std::vector<std::string> walls = allWalls();
  std::vector<std::string> hands = namesOf(allGrips());
  std::vector<std::string> devices = namesOf(allDevices());
  std::vector<int> delays_ticks{0, 1, 2, 5, 10};
  bool shipped = false;
};

std::vector<LoopCase> loopsOf(const StabilityOptions& chosen) {
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  std::vector<LoopCase> loops;
  for (const std::string& wall : chosen.walls) {
    for (const Grip& grip : allGrips()) {
      for (const DeviceKind& device : knownDevices()) {
        if (!has(chosen.hands, grip.name) || !has(chosen.devices, device.name)) continue;
        for (const int delay_ticks : chosen.delays_ticks) loops.push_back({wall, grip, device, delay_ticks});
      }
    }
  }
  return loops;
}

/// What is measured of one loop.
struct LoopResults {
  std::optional<LoopLimit> limit;
  std::optional<DefaultRun> defaults;
};
auto fieldsOf(Is<LoopResults> auto& results) {
  auto& [limit, defaults] = results;
  return std::tie(limit, defaults);
}

LoopResults measure(const LoopCase& loop, bool only_shipped) {
  LoopResults results;
  if (!only_shipped && !loop.device.hasOwnLimits()) results.limit = findLimit(loop);
  if (loop.wall != "reference") results.defaults = runDefaults(loop);
  return results;
}

Report reportOf(const std::vector<LoopResults>& loops) {
  std::vector<LoopLimit> limits;
  std::vector<DefaultRun> defaults;
  for (const LoopResults& loop : loops) {
    if (loop.limit) limits.push_back(*loop.limit);
    if (loop.defaults) defaults.push_back(*loop.defaults);
  }
  Report report;
  report.table("limits", kStabilityExplanation,
               rowsOf(limits, [&limits](const LoopLimit& limit) { return limitCells(limit, limits); }));
  report.note("/defaults", rowsOf(defaults, defaultCells));
  addDefaults(defaults, report);
  return report;
}

}  // namespace

std::string explanationOf(const LoopLimit& limit, const std::vector<LoopLimit>& limits) {
  if (isNear(limit.ratio())) return {};
  if (limit.found_n_per_m <= 0) return "NOT explained: stable nowhere";
  if (limit.loop.device.coulomb_friction_n > 0 && limit.ratio() > 1) {
    const LoopLimit* control = withoutFriction(limit, limits);
    if (control == nullptr) return "friction takes energy (no loop without it to compare with)";
    const std::string why = explanationOf(*control, limits);
    if (why.rfind("NOT", 0) != 0) {
      return fmt::format("friction takes energy: {:.2f} without it{}{}", control->ratio(),
                         why.empty() ? "" : ", ", why);
    }
  }
  const std::string rendered = explainedByStiffness(limit);
  if (!rendered.empty()) return rendered;
  return fmt::format("NOT explained: rendered to swings there {:.2f} to {:.2f} k_s", limit.softest_by_set,
                     limit.stiffest_by_set);
}

StudyCommand stabilityCommand(CLI::App& app) {
  const auto chosen = std::make_shared<StabilityOptions>();
  StudyCommand command(
      app, "stability",
      "closed loop with a simulated device and hand: largest stable stiffness compared with the theory");
  command.quick("one hand, one device and two delays", [chosen] {
    chosen->hands = {"light"};
    chosen->devices = {"45g"};
    chosen->delays_ticks = {0, 2};
  });
  command.names("--laws", chosen->walls, allWalls(), "all");
  command.names("--hands", chosen->hands, namesOf(allGrips()), "all");
  command.names("--devices", chosen->devices, namesOf(knownDevices()), "all without own limits");
  command.numbers("--delays", chosen->delays_ticks, 0, 100, "delays of the force, ms (0,1,2,5,10)");
  command.flag("--shipped", chosen->shipped, "only the laws as shipped, with the whole safety chain");
  command.parts();
  command.onRun([chosen](const StudyCommand& self) {
    return self.forEachCase(
        loopsOf(*chosen), [&](const LoopCase& loop) { return measure(loop, chosen->shipped); }, reportOf);
  });
  return command;
}

}  // namespace hapticd::tools
