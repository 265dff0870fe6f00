// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/hapticbench/accuracy.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/study.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;

constexpr const char* kExplanation =
    "Errors of the law's force against a spring of 500 N/m from the HIP to an ideal constraint on the\n"
    "true surface, 5 to 20 mm behind it: N, % of the true force, multiples of the just noticeable\n"
    "difference max(7 % of F, 0.1 N), and degrees. proxy: its distance from the true surface. pop: the\n"
    "smallest force over the pushes at which the surface gave way, or the largest that was reached (a\n"
    "push ends 45 mm deep, or where a body lets an ideal constraint go), the penetration of the HIP\n"
    "there, and how many pushes popped through below 3, 10 and 20 N. step: the largest change at a new\n"
    "frame with the HIP held still 10 mm behind the surface (spring laws: in front of it), of the law and\n"
    "of the blended command; slew: of the command at any tick.\n\n";

using Row = AccuracyRow;

Columns<Row> columns() {
  Columns<Row> list{
      {"/scene", "scene", 0, &Row::scene},
      {"/distance_m", "m", 1, &Row::distance_m},
      {"/law", "law", 0, [](const Row& r) { return nameOf(r.setting.law); }},
      {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.noise); }},
      {"/filtered", "filter", 0, [](const Row& r) { return r.setting.filtered; }},
      {"/against_surface/samples", "", 0, [](const Row& r) { return r.error.error_n.count(); }}};
  addSpread(list, "/against_surface/error_n", "rms N", "max N", [](const Row& r) { return r.error.error_n; });
  addSpread(list, "/against_surface/error_percent", "rms %", "",
            [](const Row& r) { return r.error.error_percent; });
  addSpread(list, "/against_surface/error_jnd", "JND", "max JND",
            [](const Row& r) { return r.error.error_jnd; });
  addSpread(list, "/against_surface/direction_deg", "deg", "max deg",
            [](const Row& r) { return r.error.direction_deg; });
  addSpread(list, "/proxy_to_surface_mm", "proxy mm", "max mm",
            [](const Row& r) { return r.proxy_to_surface_mm; });
  return joined<Row>(
      list,
      {{"/pushes", "pushes", 0, [](const Row& r) { return r.pops.pushes; }},
       {"/popped", "popped", 0, [](const Row& r) { return r.pops.popped; }},
       {"/popped_under_3_n", "<3 N", 0, [](const Row& r) { return r.pops.popped_under[0]; }},
       {"/popped_under_10_n", "<10 N", 0, [](const Row& r) { return r.pops.popped_under[1]; }},
       {"/popped_under_20_n", "<20 N", 0, [](const Row& r) { return r.pops.popped_under[2]; }},
       {"/dipped", "dipped", 0, [](const Row& r) { return r.pops.dipped; }},
       {"/pop_through_n", "pop N", 2, [](const Row& r) { return r.pops.least_force_n; }},
       {"/depth_at_pop_through_mm", "at mm", 1, [](const Row& r) { return r.pops.depth_at_least_force_mm; }},
       {"/law_step_n", "step N", 2, &Row::law_step_n},
       {"/blended_step_n", "blended N", 2, &Row::blended_step_n},
       {"/slew_n_per_s", "slew N/s", 1, &Row::slew_n_per_s},
       {"/ticks_outside_model", "not modelled", 0, &Row::outside_model}});
}

std::string describe(const Row& row) {
  return fmt::format("{} at {} m, noise {}, {}", row.scene, row.distance_m, nameOf(row.noise),
                     nameOf(row.setting));
}

bool isPlane(const Row& row) {
  return row.scene.starts_with("plane");
}

/// Returns the deviation of the pop-through force of the paper's springs on a plane that faces the camera
/// without noise.
std::optional<LimitedFigure> popThroughDifference_percent(const Row& row) {
  const rt::SpringParameters springs;
  const double expected_n = popThroughForceOnPlane_n(springs, {}, row.distance_m);
  return figureIf(row.scene == "plane" && row.noise == SceneNoise::none,
                  100 * std::abs(row.pops.least_force_n / expected_n - 1), 3);
}

std::vector<std::pair<ForceLaw, RowRequirement<Row>>> rowRequirements() {
  const RowRequirement<Row> no_pop_through{"pushes that pop through below 20 N", [](const Row& r) {
                                             return figureIf(true, r.pops.popped_under.back(), 0);
                                           }};
  std::vector<std::pair<ForceLaw, RowRequirement<Row>>> all;
  for (const rt::ForceLawRow& law : rt::kForceLaws) {
    if (law.has_proxy) all.emplace_back(law.law, no_pop_through);
  }
  // of single laws
  all.insert(all.end(), {{ForceLaw::nearest_springs,
                          {"pop-through force on the plane without noise compared with the closed form, %",
                           popThroughDifference_percent}},
                         {ForceLaw::surface,
                          {"RMS error on planes to 1.2 m with a sensor's noise, JND",
                           [](const Row& r) {
                             return figureIf(isSensorNoise(r.noise) && r.distance_m <= 1.2 && isPlane(r),
                                             r.error.error_jnd.rms(), 1);
                           }}},
                         {ForceLaw::surface,
                          {"error on planes without noise, % or degrees", [](const Row& r) {
                             return figureIf(
                                 r.noise == SceneNoise::none && isPlane(r),
                                 std::max(r.error.error_percent.max(), r.error.direction_deg.max()), 1);
                           }}}});
  return all;
}

}  // namespace

std::vector<AccuracyRow> summaryOf(const std::vector<AccuracyRow>& rows) {
  std::vector<AccuracyRow> summaries;
  for (const AccuracyRow& row : rows) {
    auto summary = std::ranges::find_if(summaries, [&row](const AccuracyRow& other) {
      return other.setting == row.setting && other.noise == row.noise;
    });
    if (summary == summaries.end()) {
      summary = summaries.insert(summaries.end(), AccuracyRow{.scene = "all"});
      summary->setting = row.setting;
      summary->noise = row.noise;
    }
    summary->add(row);
  }
  std::ranges::stable_sort(summaries, {}, [](const AccuracyRow& row) { return row.setting.law; });
  return summaries;
}

std::vector<Requirement> requirementsOf(const std::vector<AccuracyRow>& rows) {
  std::vector<Requirement> requirements;
  for (const auto& [law, requirement] : rowRequirements()) {
    const auto of_law = [law = law](const AccuracyRow& row) { return row.setting.law == law; };
    requirements.push_back(checked(std::string(nameOf(law)), requirement, rows, of_law, describe));
  }
  return requirements;
}

Report accuracyReport(const std::vector<AccuracyRow>& rows) {
  Report report;
  report.say(kExplanation);
  report.table("rows", "", columns(), rows);
  report.table("summary", "\nall scenes and distances together\n", columns(), summaryOf(rows));
  report.requirements(requirementsOf(rows));
  return report;
}

StudyCommand accuracyCommand(CLI::App& app) {
  struct Chosen {
    AccuracyOptions options;
    std::vector<rt::ForceLaw> laws{kAllLaws.begin(), kAllLaws.end()};
  };
  const auto chosen = std::make_shared<Chosen>();
  AccuracyOptions& options = chosen->options;
  StudyCommand command(app, "accuracy",
                       "forces on known surfaces: error, direction, pop-through, steps at new frames");
  command.quick("plane and sphere at 1 m, one push each", [&options] {
    options.scenes = {"plane", "sphere"};
    options.distances_m = {1};
    options.pushes = 1;
    options.hold_frames = 10;
  });
  command.names("--scenes", options.scenes, namesOf(accuracyScenes()), "all");
  command.choices("--laws", chosen->laws, kAllLaws, "all");
  command.numbers("--distances", options.distances_m, 0.5, 3.9, "from the camera, metres (0.6,1,2)");
  command.choices("--noises", options.noises, kAllNoises, "none,harsh");
  command.seed(options.seed, "of the positions and of the noise (1)");
  command.parts();
  command.onRun([chosen](const StudyCommand& self) {
    std::erase_if(chosen->options.settings, [&chosen](const LawSetting& setting) {
      return std::ranges::find(chosen->laws, setting.law) == chosen->laws.end();
    });
    return self.forEachCase(
        casesOf(chosen->options), [&](const AccuracyCase& one) { return measureCase(one, chosen->options); },
        [](const std::vector<std::vector<AccuracyRow>>& cases) {
          std::vector<AccuracyRow> rows;
          for (const auto& of_case : cases) rows.insert(rows.end(), of_case.begin(), of_case.end());
          return accuracyReport(rows);
        });
  });
  return command;
}

}  // namespace hapticd::tools
