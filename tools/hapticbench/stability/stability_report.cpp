// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/stability_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

namespace hapticd::tools {
namespace {

constexpr double kAllowed = 0.1;

bool isNear(double ratio) {
  return std::abs(ratio - 1) <= kAllowed;
}

std::string stiffness(double n_per_m) {
  if (std::isinf(n_per_m)) return "inf";
  return n_per_m < 100 ? fmt::format("{:.1f}", n_per_m) : fmt::format("{:.0f}", n_per_m);
}

/// Empty unless the theory's stiffness lies, within 10 %, among those that swings around the place of rest
/// meet.
std::string explainedByStiffness(const LoopLimit& limit) {
  if (isNear(limit.feltRatio())) return fmt::format("felt there: {:.2f} k_s", limit.felt_by_set);
  const double needed = 1 / limit.ratio();
  if (needed < (1 - kAllowed) * limit.softest_by_set || needed > (1 + kAllowed) * limit.stiffest_by_set)
    return {};
  return fmt::format("felt by swings there: {:.2f} to {:.2f} k_s", limit.softest_by_set,
                     limit.stiffest_by_set);
}

/// The same loop with a device of that mass and no Coulomb friction; null: not among `limits`.
const LoopLimit* withoutFriction(const LoopLimit& limit, const std::vector<LoopLimit>& limits) {
  const auto is_it = [&limit](const LoopLimit& other) {
    return other.loop.wall == limit.loop.wall && other.loop.grip.name == limit.loop.grip.name &&
           other.loop.delay_ticks == limit.loop.delay_ticks && other.loop.device.coulomb_friction_n == 0 &&
           other.loop.device.mass_kg == limit.loop.device.mass_kg;
  };
  const auto found = std::find_if(limits.begin(), limits.end(), is_it);
  return found == limits.end() ? nullptr : &*found;
}

void addHeading(fmt::memory_buffer& text) {
  fmt::format_to(std::back_inserter(text),
                 "  {:<9}{:<14}{:>5}{:>9}{:>9}{:>10}{:>7}{:>7}{:>7}{:>9}{:>8}{:>10}{:>9}  {}\n", "hand",
                 "device", "t_d", "rule", "eigen", "found", "ratio", "felt", "ratio", "cycle", "", "gives",
                 "", "");
  fmt::format_to(std::back_inserter(text),
                 "  {:<9}{:<14}{:>5}{:>9}{:>9}{:>10}{:>7}{:>7}{:>7}{:>9}{:>8}{:>10}{:>9}  {}\n", "", "", "ms",
                 "N/m", "N/m", "N/m", "", "by set", "felt", "mm p-p", "Hz", "mJ/cycle", "mW", "deviation");
}

void addRow(fmt::memory_buffer& text, const LoopLimit& limit, const std::vector<LoopLimit>& limits) {
  const ContactRun& beyond = limit.beyond;
  fmt::format_to(
      std::back_inserter(text),
      "  {:<9}{:<14}{:>5}{:>9}{:>9}{:>10}{:>7.3f}{:>7.3f}{:>7.3f}{:>9}{:>8.1f}{:>10.4f}{:>9.3f}  {}\n",
      limit.loop.grip.name, limit.loop.device.name, limit.loop.delay_ticks, stiffness(limit.rule_n_per_m),
      stiffness(limit.eigenvalue_n_per_m), (limit.capped ? ">" : "") + stiffness(limit.found_n_per_m),
      limit.ratio(), limit.felt_by_set, limit.feltRatio(),
      beyond.ran_away ? "away" : fmt::format("{:.2f}", beyond.peak_to_peak_m * 1e3), beyond.cycles_per_s,
      beyond.energy_per_cycle_j * 1e3, beyond.mean_power_w * 1e3, explanationOf(limit, limits));
}

/// How many of a wall's limits are where the theory has them.
void addSummary(fmt::memory_buffer& text, const std::vector<LoopLimit>& limits) {
  struct Count {
    int all = 0, set = 0, unexplained = 0, lower = 0;
    double lowest = 1e9, highest = 0;
  };
  std::map<std::pair<std::string, bool>, Count> counts;
  for (const LoopLimit& limit : limits) {
    Count& count = counts[{limit.loop.wall, limit.loop.device.coulomb_friction_n > 0}];
    ++count.all;
    count.set += isNear(limit.ratio()) ? 1 : 0;
    count.unexplained += explanationOf(limit, limits).rfind("NOT", 0) == 0 ? 1 : 0;
    count.lower += limit.ratio() < 1 - kAllowed ? 1 : 0;
    count.lowest = std::min(count.lowest, limit.ratio());
    count.highest = std::max(count.highest, limit.ratio());
  }
  fmt::format_to(std::back_inserter(text),
                 "\nFound stiffness by the eigenvalue limit\n  {:<18}{:<10}{:>7}{:>13}{:>11}{:>15}{:>15}\n",
                 "law", "friction", "loops", "in 10 %", "below", "range", "not explained");
  for (const auto& [key, count] : counts) {
    fmt::format_to(std::back_inserter(text), "  {:<18}{:<10}{:>7}{:>13}{:>11}{:>15}{:>15}\n", key.first,
                   key.second ? "Coulomb" : "none", count.all, count.set, count.lower,
                   fmt::format("{:.3f}-{:.3f}", count.lowest, count.highest), count.unexplained);
  }
}

bool isGood(const DefaultRun& run) {
  return run.run.stable && run.run.most_given_j <= kMostGiven_j;
}

/// What the loops of one law and delay came to.
struct DefaultsSummary {
  int all = 0, stable = 0, popped = 0, stable_without_pop = 0;
  double most_given_j = 0, most_above_potential_j = 0, least_kept_n_per_m = 1e9;
};

void addDefaults(fmt::memory_buffer& text, const std::vector<DefaultRun>& runs) {
  if (runs.empty()) return;
  std::map<std::pair<std::string, int>, DefaultsSummary> summaries;
  for (const DefaultRun& run : runs) {
    DefaultsSummary& of = summaries[{run.loop.wall, run.loop.delay_ticks}];
    ++of.all;
    of.stable += run.run.stable ? 1 : 0;
    of.popped += run.popped_through ? 1 : 0;
    of.stable_without_pop += run.run.stable && !run.popped_through ? 1 : 0;
    of.most_given_j = std::max(of.most_given_j, run.run.most_given_j);
    of.most_above_potential_j = std::max(of.most_above_potential_j, run.run.most_above_potential_j);
    of.least_kept_n_per_m = std::min(of.least_kept_n_per_m, run.stiffness_kept_n_per_m);
  }
  fmt::format_to(
      std::back_inserter(text),
      "\nShipped settings (500 N/m) with the whole safety chain, the delay reported as a driver does. "
      "pop: loops\nthat came through the plane. kept: least stiffness. gives: most energy at the "
      "hand at any time; above\npotential: the same without what the spring had stored.\n"
      "  {:<18}{:>5}{:>7}{:>8}{:>6}{:>17}{:>10}{:>10}{:>12}\n"
      "  {:<18}{:>5}{:>7}{:>8}{:>6}{:>17}{:>10}{:>10}{:>12}\n",
      "law", "t_d", "loops", "stable", "pop", "stable of others", "kept", "gives", "above pot.", "", "ms", "",
      "", "", "", "N/m", "mJ", "mJ");
  for (const auto& [key, of] : summaries) {
    fmt::format_to(std::back_inserter(text), "  {:<18}{:>5}{:>7}{:>8}{:>6}{:>17}{:>10}{:>10.2f}{:>12.2f}\n",
                   key.first, key.second, of.all, of.stable, of.popped,
                   fmt::format("{} of {}", of.stable_without_pop, of.all - of.popped),
                   stiffness(of.least_kept_n_per_m), of.most_given_j * 1e3, of.most_above_potential_j * 1e3);
  }
  if (std::all_of(runs.begin(), runs.end(), isGood)) return;
  fmt::format_to(std::back_inserter(text),
                 "\nThose that are unstable or give more than {:g} mJ\n"
                 "  {:<18}{:<9}{:<14}{:>5}{:>10}{:>10}{:>8}{:>10}{:>10}{:>12}\n",
                 kMostGiven_j * 1e3, "law", "hand", "device", "t_d", "", "mm p-p", "Hz", "kept N/m",
                 "gives mJ", "above pot.");
  for (const DefaultRun& run : runs) {
    if (isGood(run)) continue;
    const char* what = run.run.stable ? "stable" : run.run.ran_away ? "away" : "unstable";
    fmt::format_to(std::back_inserter(text),
                   "  {:<18}{:<9}{:<14}{:>5}{:>10}{:>10.3f}{:>8.1f}{:>10}{:>10.2f}{:>12.2f}{}\n",
                   run.loop.wall, run.loop.grip.name, run.loop.device.name, run.loop.delay_ticks, what,
                   run.run.peak_to_peak_m * 1e3, run.run.cycles_per_s, stiffness(run.stiffness_kept_n_per_m),
                   run.run.most_given_j * 1e3, run.run.most_above_potential_j * 1e3,
                   run.popped_through ? "  popped through" : "");
  }
}

void addRegion(fmt::memory_buffer& text, const std::vector<RegionPoint>& points) {
  if (points.empty()) return;
  struct Column {
    double largest = 0, rule = 0, eigenvalue = 0;
    bool open = true;  // no unstable point so far
  };
  std::map<std::pair<std::string, double>, Column> columns;
  for (const RegionPoint& point : points) {
    Column& column = columns[{point.wall, point.damping_n_s_per_m}];
    column.rule = point.rule_n_per_m;
    column.eigenvalue = point.eigenvalue_n_per_m;
    column.open = column.open && point.stable;
    if (column.open) column.largest = point.stiffness_n_per_m;
  }
  fmt::format_to(std::back_inserter(text),
                 "\n(K, B) region: largest stiffness of the grid with all below it stable\n"
                 "  {:<18}{:>10}{:>10}{:>10}{:>10}\n",
                 "law", "B N s/m", "K N/m", "rule", "eigen");
  for (const auto& [key, column] : columns) {
    fmt::format_to(std::back_inserter(text), "  {:<18}{:>10.2f}{:>10}{:>10}{:>10}\n", key.first, key.second,
                   stiffness(column.largest), stiffness(column.rule), stiffness(column.eigenvalue));
  }
}

nlohmann::ordered_json jsonOf(const LoopCase& loop) {
  return {{"law", loop.wall},
          {"hand", loop.grip.name},
          {"hand_stiffness_n_per_m", loop.grip.stiffness_n_per_m},
          {"hand_damping_n_s_per_m", loop.grip.damping_n_s_per_m},
          {"hand_mass_kg", loop.grip.mass_kg},
          {"device", loop.device.name},
          {"device_mass_kg", loop.device.mass_kg},
          {"device_damping_n_s_per_m", loop.device.damping_n_s_per_m},
          {"device_friction_n", loop.device.coulomb_friction_n},
          {"device_quantum_m", loop.device.quantum_m},
          {"delay_ticks", loop.delay_ticks}};
}

nlohmann::ordered_json jsonOf(const ContactRun& run) {
  return {{"stable", run.stable},
          {"ran_away", run.ran_away},
          {"seconds", run.seconds},
          {"peak_to_peak_m", run.peak_to_peak_m},
          {"mean_h_m", run.mean_m},
          {"cycles_per_s", run.cycles_per_s},
          {"energy_per_cycle_j", run.energy_per_cycle_j},
          {"mean_power_w", run.mean_power_w},
          {"most_given_j", run.most_given_j},
          {"deepest_h_m", run.deepest_m}};
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
  const std::string felt = explainedByStiffness(limit);
  if (!felt.empty()) return felt;
  return fmt::format("NOT explained: felt by swings there {:.2f} to {:.2f} k_s", limit.softest_by_set,
                     limit.stiffest_by_set);
}

std::string stabilityTable(const StabilityResults& results) {
  fmt::memory_buffer text;
  fmt::format_to(
      std::back_inserter(text),
      "Closed loop at 1 kHz, one axis, a fronto-parallel plane at 1 m. rule: (b + B)/(T/2 + t_d) with\n"
      "the hand's damping in b. eigen: limit of the linear two-sided loop. found: largest stable k_s\n"
      "(2 %), ratio: by eigen. felt by set: -dF/dh where the motion rests, by k_s. cycle, gives: motion\n"
      "and energy that the surface gives at 1.2 times the found stiffness.\n");
  std::string wall;
  for (const LoopLimit& limit : results.limits) {
    if (limit.loop.wall != wall) {
      wall = limit.loop.wall;
      fmt::format_to(std::back_inserter(text), "\n{}\n", wall);
      addHeading(text);
    }
    addRow(text, limit, results.limits);
  }
  addSummary(text, results.limits);
  addDefaults(text, results.defaults);
  addRegion(text, results.region);
  return fmt::to_string(text);
}

std::string stabilityJson(const StabilityResults& results) {
  nlohmann::ordered_json document{{"benchmark", "stability"}, {"period_s", kTick_s}};
  auto& limits = document["limits"] = nlohmann::ordered_json::array();
  for (const LoopLimit& limit : results.limits) {
    nlohmann::ordered_json row = jsonOf(limit.loop);
    row["rule_n_per_m"] = limit.rule_n_per_m;
    row["eigenvalue_n_per_m"] = limit.eigenvalue_n_per_m;
    row["found_n_per_m"] = limit.found_n_per_m;
    row["capped"] = limit.capped;
    row["felt_by_set"] = limit.felt_by_set;
    row["softest_by_set"] = limit.softest_by_set;
    row["stiffest_by_set"] = limit.stiffest_by_set;
    row["rest_h_m"] = limit.rest_h_m;
    row["explanation"] = explanationOf(limit, results.limits);
    row["at_1_2_times_found"] = jsonOf(limit.beyond);
    limits.push_back(row);
  }
  auto& defaults = document["defaults"] = nlohmann::ordered_json::array();
  for (const DefaultRun& run : results.defaults) {
    nlohmann::ordered_json row = jsonOf(run.loop);
    row.update(jsonOf(run.run));
    row["most_above_potential_j"] = run.run.most_above_potential_j;
    row["stiffness_kept_n_per_m"] = run.stiffness_kept_n_per_m;
    row["popped_through"] = run.popped_through;
    defaults.push_back(row);
  }
  auto& region = document["region"] = nlohmann::ordered_json::array();
  for (const RegionPoint& point : results.region) {
    region.push_back({{"law", point.wall},
                      {"stiffness_n_per_m", point.stiffness_n_per_m},
                      {"damping_n_s_per_m", point.damping_n_s_per_m},
                      {"stable", point.stable},
                      {"rule_n_per_m", point.rule_n_per_m},
                      {"eigenvalue_n_per_m", point.eigenvalue_n_per_m}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
