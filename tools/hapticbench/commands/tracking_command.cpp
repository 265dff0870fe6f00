// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/tracking/tracking.h"

namespace hapticd::tools {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

struct Chosen {
  std::vector<SolidKind> solids{SolidKind::organ, SolidKind::ellipsoid, SolidKind::round_ellipsoid,
                                SolidKind::corner, SolidKind::sphere};
  std::vector<TrackingNoise> noises{kTrackingNoises.begin(), kTrackingNoises.end()};
  std::vector<double> distances_m{0.6, 1.0};
  TrackingSettings settings;
  std::string recordings;
};

constexpr const char* kExplanation =
    "Solids of about 100 mm, at rest before a wall. near, far: error of the place of the surface that faces\n"
    "the camera, and of one 30 mm behind the middle, of fits that estimate every direction; expected: "
    "standard\n"
    "deviation of near that the tracker states; floor: the smallest that the noise allows these points\n"
    "(Cramer-Rao bound; -: undetermined, as are the errors). accepted: with the limits as shipped, where\n"
    "directions below 2 % are not estimated. hard: bad starts, other bodies in front, other bodies or none "
    "in\n"
    "place of the solid; right: of these, results that are accepted and right; failures: of these, results\n"
    "that are not right; found: of the failures, the share that is refused.\n\n";

Json figureOf(const std::vector<double>& values, double share) {
  return values.empty() ? Json() : Json(quantile(values, share));
}

using Row = TrackingRow;

/// Median, 95 % and largest of a list of the row; nothing where a motion that does not show makes them
/// meaningless.
void addQuantiles(Columns<Row>& columns, const std::string& key, const std::string& heading, int decimals,
                  double scale, const std::vector<double> Row::*values) {
  constexpr double kHigh = 0.95;
  const auto add = [&](const char* member, const std::string& shown, double share) {
    columns.push_back({key + member, shown, decimals,
                       [values, share](const Row& row) {
                         return std::isfinite(row.floor_near_m) ? figureOf(row.*values, share) : Json();
                       },
                       scale});
  };
  add("/median", heading, 0.5);
  add("/p95", "p95", kHigh);
  add("/max", "max", 1);
}

Columns<Row> columns() {
  Columns<Row> list{
      {"/solid", "solid", 0, [](const Row& row) { return nameOf(row.chosen.solid); }},
      {"/noise", "noise", 0, [](const Row& row) { return nameOf(row.chosen.noise); }},
      {"/distance_m", "m", 1, [](const Row& row) { return row.chosen.distance_m; }},
      {"/points", "points", 0, [](const Row& row) { return figureOf(row.points, 0.5); }},
      {"/condition", "min/max", 4, [](const Row& row) { return figureOf(row.condition, 0.5); }}};
  addQuantiles(list, "/rotation_rad", "rot. deg", 2, kDegreesPerRadian, &Row::rotation_rad);
  addQuantiles(list, "/near_m", "near mm", 2, 1e3, &Row::near_m);
  addQuantiles(list, "/far_m", "far mm", 2, 1e3, &Row::far_m);
  const Columns<Row> more{
      {"/expected_m", "expected", 2, [](const Row& row) { return figureOf(row.expected_m, 0.5); }, 1e3},
      {"/floor_m", "floor", 2,
       [](const Row& row) { return std::isfinite(row.floor_near_m) ? Json(row.floor_near_m) : Json(); }, 1e3},
      {"/accepted_percent", "accepted %", 0,
       [](const Row& row) { return percentOf(row.starts - row.refused, row.starts); }},
      {"/accepted_near_m/p95", "p95 mm", 2,
       [](const Row& row) { return figureOf(row.accepted_near_m, 0.95); }, 1e3},
      {"/accepted_near_m/max", "max mm", 2, [](const Row& row) { return figureOf(row.accepted_near_m, 1); },
       1e3},
      {"/hard_cases", "hard", 0, &Row::hard_cases},
      {"/hard_right_percent", "right %", 0,
       [](const Row& row) { return percentOf(row.hard_accepted, row.hard_cases); }},
      {"/failures", "failures", 0, &Row::failures},
      {"/found_percent", "found %", 1, &Row::foundPercent},
      {"/cpu_s/median", "CPU ms", 2, [](const Row& row) { return figureOf(row.cpu_s, 0.5); }, 1e3},
      {"/cpu_s/p95", "p95", 2, [](const Row& row) { return figureOf(row.cpu_s, 0.95); }, 1e3},
      {"/verdicts", "", 0, [](const Row& row) {
         Json counts = Json::object();
         for (std::size_t i = 0; i < row.verdicts.size(); ++i)
           counts[std::string(rt::kWords<rt::TrackingVerdict>[i])] = row.verdicts[i];
         return counts;
       }}};
  return joined(list, more);
}

/// Largest error of what is accepted: 1 mm at 0.6 m and 2.5 mm at 1 m, growing with the square of the
/// distance as the noise does; where the noise does not allow that, three times its floor.
double bound_m(const Row& row) {
  const double z = row.chosen.distance_m;
  constexpr double kSigmas = 3;
  constexpr double kErrorAt1m_m = 0.0025;
  return std::max(kErrorAt1m_m * z * z, std::isfinite(row.floor_near_m) ? kSigmas * row.floor_near_m : 0);
}

std::vector<Requirement> requirementsOf(const std::vector<Row>& rows) {
  const std::vector<RowRequirement<Row>> all{
      {"failures that are accepted",
       [](const Row& row) { return figureIf(row.failures > 0, row.wronglyAccepted(), 0); }},
      {"error of what is accepted, 95 %, m", [](const Row& row) {
         const bool applies = !row.accepted_near_m.empty();
         return figureIf(applies, applies ? quantile(row.accepted_near_m, 0.95) : 0, bound_m(row));
       }}};
  std::vector<Requirement> requirements;
  for (const RowRequirement<Row>& one : all) {
    requirements.push_back(checked<Row>(
        "", one, rows, [](const Row&) { return true; },
        [](const Row& row) {
          return fmt::format("{}, {}, {} m", nameOf(row.chosen.solid), nameOf(row.chosen.noise),
                             row.chosen.distance_m);
        }));
  }
  return requirements;
}

/// The noise of the recording in the folder whose pixels rest; nothing where there is none.
base::Result<std::optional<RecordedNoise>> recordedNoise(const std::string& folder, std::string& name) {
  constexpr std::size_t kFrames = 24;
  const auto sequences = recordedSequences(folder, kFrames);
  if (!sequences) return std::unexpected(sequences.error());
  std::optional<RecordedNoise> found;
  for (const BenchSequence& sequence : *sequences) {
    if (auto noise = RecordedNoise::of(sequence)) {
      found = std::move(noise);
      name = sequence.name;
    }
  }
  return found;
}

int runTracking(const Chosen& chosen, const StudyCommand& command) {
  Report report;
  report.say(kExplanation);
  std::optional<RecordedNoise> recorded;
  if (std::ranges::find(chosen.noises, TrackingNoise::recorded) != chosen.noises.end()) {
    std::string name;
    auto noise = recordedNoise(chosen.recordings, name);
    if (!noise) return fail(noise.error(), EX_NOINPUT);
    recorded = std::move(*noise);
    report.note("recording", name);
    report.say(recorded
                   ? fmt::format("recorded: what changes from frame to frame in {}\n\n", name)
                   : fmt::format("recorded: left out, no recording at rest in {}\n\n", chosen.recordings));
  }
  std::vector<Row> rows;
  for (const TrackingNoise noise : chosen.noises) {
    if (noise == TrackingNoise::recorded && !recorded) continue;
    for (const double distance_m : chosen.distances_m) {
      for (const SolidKind solid : chosen.solids) {
        showProgress(fmt::format("{}, {}, {} m", nameOf(solid), nameOf(noise), distance_m));
        rows.push_back(
            measureTracking({solid, noise, distance_m}, chosen.settings, recorded ? &*recorded : nullptr));
      }
    }
  }
  report.note("trials", chosen.settings.trials);
  report.note("limit_m", chosen.settings.limit_m);
  report.table("rows", fmt::format("{} poses of each solid\n", chosen.settings.trials), columns(), rows);
  report.requirements(requirementsOf(rows));
  return command.report(report);
}

}  // namespace

StudyCommand trackingCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(app, "tracking",
                       "how exactly a depth camera finds the pose of a solid, and what it refuses");
  command.quick("an organ and a sphere at 0.6 m, 2 poses, 20 bad starts", [chosen] {
    chosen->solids = {SolidKind::organ, SolidKind::sphere};
    chosen->noises = {TrackingNoise::kinect};
    chosen->distances_m = {0.6};
    chosen->settings.trials = 2;
    chosen->settings.bad_starts = 20;
  });
  command.choices("--solids", chosen->solids, kAllSolids, "all but cylinder and plate");
  command.choices("--noises", chosen->noises, kTrackingNoises, "all");
  command.numbers("--distances", chosen->distances_m, 0.2, 2.0,
                  "metres from the camera to the middle (0.6,1)");
  command->add_option("--trials", chosen->settings.trials, "poses of each solid (20)")
      ->check(within(1, 10'000));
  command->add_option("--bad-starts", chosen->settings.bad_starts, "bad starts of each case (200)")
      ->check(within(0, 1'000'000));
  command
      ->add_option("--limit", chosen->settings.limit_m,
                   "largest error of the target in metres that is accepted (0.003)")
      ->check(within(0.0001, 0.1));
  command.seed(chosen->settings.seed, "of poses, starts and noise (1)");
  command.recordings(chosen->recordings);
  command.onRun([chosen](const StudyCommand& self) { return runTracking(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
