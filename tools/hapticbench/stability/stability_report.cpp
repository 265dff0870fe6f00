// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/stability_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/hapticbench/table.h"

namespace hapticd::tools {
namespace {

constexpr double kAllowed = 0.1;

constexpr const char* kExplanation =
    "Closed loop at 1 kHz, one axis, a plane 1 m away that faces the camera. rule: (b + B)/(T/2 + t_d)\n"
    "with the hand's damping in b; eigen: limit of the linear two-sided loop; found: largest stable k_s\n"
    "(2 %); ratio: found by eigen; rendered: -dF/dh where the motion rests, by k_s. cycle, gives: motion "
    "and\n"
    "energy that the surface gives at 1.2 times the stiffness that was found.\n\n";

constexpr const char* kDefaultsExplanation =
    "\nShipped settings (500 N/m) with the whole safety chain; the delay is reported as a driver does.\n"
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

/// The columns that identify the loop of a row.
template <typename Row>
std::vector<Column<Row>> loopColumns() {
  return {{"/law", "law", 0, [](const Row& r) { return r.loop.wall; }},
          {"/hand", "hand", 0, [](const Row& r) { return r.loop.grip.name; }},
          {"/hand_stiffness_n_per_m", "", 0, [](const Row& r) { return r.loop.grip.stiffness_n_per_m; }},
          {"/hand_damping_n_s_per_m", "", 0, [](const Row& r) { return r.loop.grip.damping_n_s_per_m; }},
          {"/hand_mass_kg", "", 0, [](const Row& r) { return r.loop.grip.mass_kg; }},
          {"/device", "device", 0, [](const Row& r) { return r.loop.device.name; }},
          {"/device_mass_kg", "", 0, [](const Row& r) { return r.loop.device.mass_kg; }},
          {"/device_damping_n_s_per_m", "", 0, [](const Row& r) { return r.loop.device.damping_n_s_per_m; }},
          {"/device_friction_n", "", 0, [](const Row& r) { return r.loop.device.coulomb_friction_n; }},
          {"/device_quantum_m", "", 0, [](const Row& r) { return r.loop.device.quantum_m; }},
          {"/delay_ticks", "t_d ms", 0, [](const Row& r) { return r.loop.delay_ticks; }}};
}

/// The figures of a run, as members of the object at `key`.
template <typename Row>
void addRun(std::vector<Column<Row>>& columns, const std::string& key, ContactRun Row::*run) {
  const auto add = [&](const char* name, const char* heading, int decimals, auto figure, double scale = 1) {
    columns.push_back({key + name, heading, decimals,
                       [run, figure](const Row& r) -> Json { return r.*run.*figure; }, scale});
  };
  add("/stable", "stable", 0, &ContactRun::stable);
  add("/ran_away", "ran away", 0, &ContactRun::ran_away);
  add("/seconds", "", 0, &ContactRun::seconds);
  add("/peak_to_peak_m", "mm p-p", 3, &ContactRun::peak_to_peak_m, 1e3);
  add("/mean_h_m", "", 0, &ContactRun::mean_m);
  add("/cycles_per_s", "Hz", 1, &ContactRun::cycles_per_s);
  add("/energy_per_cycle_j", "mJ/cycle", 4, &ContactRun::energy_per_cycle_j, 1e3);
  add("/mean_power_w", "mW", 3, &ContactRun::mean_power_w, 1e3);
  add("/most_given_j", "gives mJ", 2, &ContactRun::most_given_j, 1e3);
  add("/deepest_h_m", "", 0, &ContactRun::deepest_m);
}

/// The columns of `limits`, which the explanations look at.
std::vector<Column<LoopLimit>> limitColumns(const std::vector<LoopLimit>& limits) {
  using Row = LoopLimit;
  std::vector<Column<Row>> columns = loopColumns<Row>();
  const std::vector<Column<Row>> figures{
      {"/rule_n_per_m", "rule N/m", 0, &Row::rule_n_per_m},
      {"/eigenvalue_n_per_m", "eigen N/m", 0, &Row::eigenvalue_n_per_m},
      {"/found_n_per_m", "found N/m", 0, &Row::found_n_per_m},
      {"/capped", "capped", 0, &Row::capped},
      {"", "ratio", 3, [](const Row& r) { return r.ratio(); }},
      {"/felt_by_set", "rendered", 3, &Row::rendered_by_set},
      {"/softest_by_set", "softest", 3, &Row::softest_by_set},
      {"/stiffest_by_set", "stiffest", 3, &Row::stiffest_by_set},
      {"/rest_h_m", "", 0, &Row::rest_h_m},
      {"/explanation", "deviation", 0, [&limits](const Row& r) { return explanationOf(r, limits); }}};
  columns.insert(columns.end(), figures.begin(), figures.end());
  addRun(columns, "/at_1_2_times_found", &Row::beyond);
  return columns;
}

const std::vector<Column<DefaultRun>>& defaultColumns() {
  using Row = DefaultRun;
  static const std::vector<Column<Row>> all = [] {
    std::vector<Column<Row>> columns = loopColumns<Row>();
    addRun(columns, "", &Row::run);
    columns.push_back({"/most_above_potential_j", "above potential mJ", 2,
                       [](const Row& r) { return r.run.most_above_potential_j; }, 1e3});
    columns.push_back({"/stiffness_kept_n_per_m", "kept N/m", 0, &Row::stiffness_kept_n_per_m});
    columns.push_back({"/popped_through", "popped", 0, &Row::popped_through});
    return columns;
  }();
  return all;
}

/// The loops of one law and delay with the shipped settings together.
struct DefaultsSummary {
  std::string law;
  int delay_ticks = 0;
  int all = 0, stable = 0, popped = 0, stable_without_pop = 0;
  double most_given_j = 0, most_above_potential_j = 0, least_kept_n_per_m = 1e9;
};

std::string defaultsText(const std::vector<DefaultRun>& runs) {
  using Row = DefaultsSummary;
  if (runs.empty()) return "";
  std::map<std::pair<std::string, int>, Row> summaries;
  std::vector<DefaultRun> bad;
  for (const DefaultRun& run : runs) {
    const std::pair key{run.loop.wall, run.loop.delay_ticks};
    Row& row = summaries.try_emplace(key, Row{key.first, key.second}).first->second;
    ++row.all;
    row.stable += run.run.stable ? 1 : 0;
    row.popped += run.popped_through ? 1 : 0;
    row.stable_without_pop += run.run.stable && !run.popped_through ? 1 : 0;
    row.most_given_j = std::max(row.most_given_j, run.run.most_given_j);
    row.most_above_potential_j = std::max(row.most_above_potential_j, run.run.most_above_potential_j);
    row.least_kept_n_per_m = std::min(row.least_kept_n_per_m, run.stiffness_kept_n_per_m);
    if (!run.run.stable || run.run.most_given_j > kMostGiven_j) bad.push_back(run);
  }
  std::vector<Row> rows;
  for (const auto& [key, row] : summaries) rows.push_back(row);
  const std::vector<Column<Row>> columns{{"", "law", 0, &Row::law},
                                         {"", "t_d ms", 0, &Row::delay_ticks},
                                         {"", "loops", 0, &Row::all},
                                         {"", "stable", 0, &Row::stable},
                                         {"", "popped", 0, &Row::popped},
                                         {"", "stable of the others", 0, &Row::stable_without_pop},
                                         {"", "kept N/m", 0, &Row::least_kept_n_per_m},
                                         {"", "gives mJ", 2, &Row::most_given_j, 1e3},
                                         {"", "above potential mJ", 2, &Row::most_above_potential_j, 1e3}};
  std::string text = kDefaultsExplanation + tableText(columns, rows);
  if (bad.empty()) return text;
  return text + fmt::format("\nunstable, or giving more than {:g} mJ\n", kMostGiven_j * 1e3) +
         tableText(defaultColumns(), bad);
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

std::string stabilityText(const StabilityResults& results) {
  return kExplanation + tableText(limitColumns(results.limits), results.limits) +
         defaultsText(results.defaults);
}

std::string stabilityJson(const StabilityResults& results) {
  const Json document{{"benchmark", "stability"},
                      {"period_s", kTick_s},
                      {"limits", tableJson(limitColumns(results.limits), results.limits)},
                      {"defaults", tableJson(defaultColumns(), results.defaults)}};
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
