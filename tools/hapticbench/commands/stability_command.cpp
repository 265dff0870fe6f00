// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/stability.h"

namespace hapticd::tools {
namespace {

constexpr double kAllowed = 0.1;

constexpr const char* kExplanation =
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

/// The columns that identify the loop of a row, and `figures`.
template <typename Row>
Columns<Row> columnsWith(const Columns<Row>& figures) {
  return joined<Row>({{"/law", "law", 0, [](const Row& r) { return r.loop.wall; }},
                      {"/hand", "hand", 0, [](const Row& r) { return r.loop.grip.name; }},
                      {"/device", "device", 0, [](const Row& r) { return r.loop.device.name; }},
                      {"/delay_ticks", "t_d ms", 0, [](const Row& r) { return r.loop.delay_ticks; }}},
                     figures);
}

/// The columns of `limits`, which the explanations look at.
Columns<LoopLimit> limitColumns(const std::vector<LoopLimit>& limits) {
  using Row = LoopLimit;
  return columnsWith<Row>(
      {{"/rule_n_per_m", "rule N/m", 0, &Row::rule_n_per_m},
       {"/eigenvalue_n_per_m", "eigen N/m", 0, &Row::eigenvalue_n_per_m},
       {"/found_n_per_m", "found N/m", 0, &Row::found_n_per_m},
       {"/capped", "capped", 0, &Row::capped},
       {"/ratio", "ratio", 3, &Row::ratio},
       {"/felt_by_set", "rendered", 3, &Row::rendered_by_set},
       {"/softest_by_set", "softest", 3, &Row::softest_by_set},
       {"/stiffest_by_set", "stiffest", 3, &Row::stiffest_by_set},
       {"/explanation", "deviation", 0, [&limits](const Row& r) { return explanationOf(r, limits); }}});
}

Columns<DefaultRun> defaultColumns() {
  using Row = DefaultRun;
  return columnsWith<Row>(
      {{"/stable", "stable", 0, [](const Row& r) { return r.run.stable; }},
       {"/ran_away", "ran away", 0, [](const Row& r) { return r.run.ran_away; }},
       {"/peak_to_peak_m", "mm p-p", 3, [](const Row& r) { return r.run.peak_to_peak_m; }, 1e3},
       {"/most_given_j", "gives mJ", 2, [](const Row& r) { return r.run.most_given_j; }, 1e3},
       {"/most_above_potential_j", "above potential mJ", 2,
        [](const Row& r) { return r.run.most_above_potential_j; }, 1e3},
       {"/stiffness_kept_n_per_m", "kept N/m", 0, &Row::stiffness_kept_n_per_m},
       {"/popped_through", "popped", 0, &Row::popped_through}});
}

/// The loops of one law and delay together, apart for each device with limits of its own.
struct DefaultsSummary {
  std::string law;
  std::string device;  ///< empty: all that have none
  int delay_ticks = 0;
  int all = 0, stable = 0, popped = 0, stable_without_pop = 0;
  double most_given_j = 0, most_above_potential_j = 0, least_kept_n_per_m = 1e9;
};

void addDefaults(const std::vector<DefaultRun>& runs, Report& report) {
  using Row = DefaultsSummary;
  std::map<std::tuple<std::string, std::string, int>, Row> summaries;
  std::vector<DefaultRun> bad;
  for (const DefaultRun& run : runs) {
    const std::string device = run.loop.device.hasOwnLimits() ? run.loop.device.name : "";
    const std::tuple key{run.loop.wall, device, run.loop.delay_ticks};
    Row& row = summaries.try_emplace(key, Row{run.loop.wall, device, run.loop.delay_ticks}).first->second;
    ++row.all;
    row.stable += run.run.stable ? 1 : 0;
    row.popped += run.popped_through ? 1 : 0;
    row.stable_without_pop += run.run.stable && !run.popped_through ? 1 : 0;
    row.most_given_j = std::max(row.most_given_j, run.run.most_given_j);
    row.most_above_potential_j = std::max(row.most_above_potential_j, run.run.most_above_potential_j);
    row.least_kept_n_per_m = std::min(row.least_kept_n_per_m, run.stiffness_kept_n_per_m);
    if (!run.run.stable || run.run.most_given_j > kMaxGiven_j) bad.push_back(run);
  }
  std::vector<Row> rows;
  for (const auto& [key, row] : summaries) rows.push_back(row);
  const Columns<Row> columns{{"", "law", 0, &Row::law},
                             {"", "device", 0, &Row::device},
                             {"", "t_d ms", 0, &Row::delay_ticks},
                             {"", "loops", 0, &Row::all},
                             {"", "stable", 0, &Row::stable},
                             {"", "popped", 0, &Row::popped},
                             {"", "stable of the others", 0, &Row::stable_without_pop},
                             {"", "kept N/m", 0, &Row::least_kept_n_per_m},
                             {"", "gives mJ", 2, &Row::most_given_j, 1e3},
                             {"", "above potential mJ", 2, &Row::most_above_potential_j, 1e3}};
  report.show("shipped settings", kDefaultsExplanation, columns, rows);
  if (bad.empty()) return;
  const std::string title = fmt::format("unstable, or giving more than {:g} mJ", kMaxGiven_j * 1e3);
  report.show(title, "\n" + title + "\n", defaultColumns(), bad);
}

std::vector<DeviceKind> knownDevices() {
  std::vector<DeviceKind> devices = allDevices();
  devices.insert(devices.end(), devicesOnSale().begin(), devicesOnSale().end());
  return devices;
}

struct Chosen {
  std::vector<std::string> walls = allWalls();
  std::vector<std::string> hands = namesOf(allGrips());
  std::vector<std::string> devices = namesOf(allDevices());
  std::vector<int> delays_ticks{0, 1, 2, 5, 10};
  bool shipped = false;
};

std::vector<LoopCase> loopsOf(const Chosen& chosen) {
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
  report.table("limits", kExplanation, limitColumns(limits), limits);
  report.note("defaults", tableJson(defaultColumns(), defaults));
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
  const auto chosen = std::make_shared<Chosen>();
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
  command->add_flag("--shipped", chosen->shipped, "only the laws as shipped, with the whole safety chain");
  command.parts();
  command.onRun([chosen](const StudyCommand& self) {
    return self.forEachCase(
        loopsOf(*chosen), [&](const LoopCase& loop) { return measure(loop, chosen->shipped); }, reportOf);
  });
  return command;
}

}  // namespace hapticd::tools
