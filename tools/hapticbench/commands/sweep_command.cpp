// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "config/settings/law_choice.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/stability.h"
#include "tools/hapticbench/sweep.h"

namespace hapticd::tools {

bool SweepPoint::isPapers() const {
  const rt::SpringParameters papers;
  return law == rt::ForceLaw::nearest_springs && springs.stiffness_n_per_m == papers.stiffness_n_per_m &&
         springs.radius_m == papers.radius_m && springs.min_points == papers.min_points &&
         springs.max_points == papers.max_points;
}

std::vector<SweepPoint> pointsOf(const SweepGrid& grid) {
  std::vector<SweepPoint> points;
  rt::SpringParameters springs;
  const auto add = [&](bool uses_radius, bool uses_max_points) {
    for (const rt::ForceLawRow& row : rt::kForceLaws) {
      if (row.looks_in_radius != uses_radius || row.limits_points != uses_max_points) continue;
      points.push_back({points.size(), row.law, springs});
    }
  };
  for (const double stiffness : grid.stiffnesses_n_per_m) {
    springs = {.stiffness_n_per_m = stiffness};
    add(false, false);
    for (const double radius : grid.radii_m) {
      springs.radius_m = radius;
      add(true, false);
      for (const int count : grid.max_points) {
        springs.max_points = count;
        add(true, true);
      }
      springs.max_points = rt::SpringParameters{}.max_points;
    }
  }
  return points;
}

SweepGrid gridOf(const SweepSettings& settings) {
  return settings.quick ? SweepGrid::quick() : SweepGrid{};
}

rt::LiveParameters parametersOf(const SweepPoint& point) {
  rt::LiveParameters parameters;
  parameters.law = point.law;
  parameters.force = {point.springs, {}};
  return parameters;
}

BenchSequence syntheticSequence(std::size_t frames) {
  TrueScene scene({.kind = SceneKind::plane, .distance_m = 1.2, .tilt_rad = 0.3});
  BenchSequence sequence{"synthetic", {}};
  for (std::size_t i = 0; i < frames; ++i) {
    sequence.frames.push_back(std::make_unique<rt::DepthFrame>());
    scene.render(0, i + 1, SceneNoise::sensor, *sequence.frames.back());
  }
  return sequence;
}

Sweep::Sweep(const SweepSettings& settings, const NoiseProbe& noise)
    : settings_(settings), noise_(noise), feel_(settings.quick ? 1.5 : 1.15, settings.timed) {
  const DeviceAndHand light{.hand_stiffness_n_per_m = 400, .hand_damping_n_s_per_m = 4};
  limit_n_per_m_ = eigenvalueLimit_n_per_m(light, {.delay_ticks = kMarginDelay_ticks});
}

SweepResult Sweep::measure(const SweepPoint& point) {
  SweepResult result{point, feel_.measure(parametersOf(point)), {}, std::numeric_limits<double>::infinity()};
  result.noise = noise_.measure(parametersOf(point), result.feel.stroke_h_m);
  const double steepest = result.feel.steepest_stiffness_n_per_m;
  if (steepest > 0) result.stability_margin = limit_n_per_m_ / steepest;
  return result;
}

namespace {

constexpr const char* kExplanation =
    "Known surfaces 1 m away. rendered, steepest: -dF/dh from 5 to 15 mm penetration, or from the onset of\n"
    "a spring law to its peak, mean and over 1 mm. pops at: force at which the surface gives way, 20: not\n"
    "below that. edge: where the force is half of the plane's, mm beyond (+) or before (-) the end of a\n"
    "half-plane. ridge: height of the lowest ridge of 20 mm width that changes the force by one JND (7 %,\n"
    "0.1 N at least), 0: none of those tried. noise: standard deviation of the force from frame to frame,\n"
    "median and largest of still places. margin: largest stable stiffness of a 45 g device in a light hand\n"
    "at 2 ms delay by the steepest.\n\n";

Columns<SweepResult> columns() {
  using Row = SweepResult;
  return {
      {"/index", "", 0, [](const Row& r) { return r.point.index; }},
      {"/law", "law", 0, [](const Row& r) { return config::nameOf(r.point.law); }},
      {"", "set", 0, [](const Row& r) { return r.point.isPapers() ? "the paper's" : ""; }},
      {"/stiffness_n_per_m", "k_s N/m", 0, [](const Row& r) { return r.point.springs.stiffness_n_per_m; }},
      {"/radius_m", "D mm", 0,
       [](const Row& r) { return figureWhere(r.point.usesRadius(), r.point.springs.radius_m); }, 1e3},
      {"/max_points", "N_max", 0,
       [](const Row& r) { return figureWhere(r.point.usesMaxPoints(), r.point.springs.max_points); }},
      {"/felt_stiffness_n_per_m", "rendered N/m", 0,
       [](const Row& r) { return r.feel.rendered_stiffness_n_per_m; }},
      {"/steepest_stiffness_n_per_m", "steepest N/m", 0,
       [](const Row& r) { return r.feel.steepest_stiffness_n_per_m; }},
      {"/pop_through_n", "pops at N", 2, [](const Row& r) { return r.feel.pop_through_n; }},
      {"/edge_m", "edge mm", 1, [](const Row& r) { return r.feel.edge_m; }, 1e3},
      {"/smallest_ridge_m", "ridge mm", 2, [](const Row& r) { return r.feel.smallest_ridge_m; }, 1e3},
      {"/noise_median_n", "noise N", 3, [](const Row& r) { return r.noise.median_n; }},
      {"/noise_largest_n", "largest N", 3, [](const Row& r) { return r.noise.largest_n; }},
      {"", "margin", 2, [](const Row& r) { return r.stability_margin; }},
      {"/stability_margin", "", 0,  // JSON has no infinity
       [](const Row& r) { return figureWhere(std::isfinite(r.stability_margin), r.stability_margin); }},
      {"/median_force_us", "us", 2, [](const Row& r) {
         return figureWhere(r.feel.median_force_us.has_value(), r.feel.median_force_us.value_or(0));
       }}};
}

}  // namespace

Report sweepReport(const SweepSettings& settings, const std::vector<SweepResult>& results) {
  std::vector<SweepResult> sorted = results;
  std::ranges::stable_sort(sorted, {}, [](const SweepResult& result) { return result.point.law; });
  Report report;
  report.note("noise_source", settings.noise_source);
  report.note("noise_digest", settings.noise_digest);
  report.say(kExplanation);
  report.table("points", fmt::format("noise of {}\n", settings.noise_source), columns(), sorted);
  return report;
}

namespace {

struct Chosen {
  SweepSettings settings;
  std::string recordings;
};

/// "synthetic" where there are no recordings.
std::string sourceOf(const std::vector<BenchSequence>& sequences) {
  std::vector<std::string> names;
  for (const BenchSequence& sequence : sequences) names.push_back(sequence.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

base::Result<std::vector<BenchSequence>> sequencesOf(const Chosen& chosen) {
  const std::size_t frames = chosen.settings.quick ? 6 : 24;  // of each recording
  auto sequences = recordedSequences(chosen.recordings, frames);
  if (sequences && sequences->empty()) {
    fmt::print(stderr, "hapticbench: no recordings in {}: noise of a simulated sensor\n", chosen.recordings);
    sequences->push_back(syntheticSequence(frames));
  }
  return sequences;
}

int runSweep(const Chosen& chosen, const StudyCommand& command) {
  SweepSettings settings = chosen.settings;
  std::optional<NoiseProbe> noise;
  std::optional<Sweep> sweep;
  if (!command.joined()) {
    auto sequences = sequencesOf(chosen);
    if (!sequences) return fail(sequences.error(), EX_NOINPUT);
    settings.noise_source = sourceOf(*sequences);
    settings.noise_digest = digestOf(*sequences);
    const std::size_t sites = settings.quick ? 2 : 6;  // in each recording
    noise.emplace(std::move(*sequences), sites);
    sweep.emplace(settings, *noise);
  } else {
    settings.noise_source = command.joined()->run.input.value("noise_source", "");
    settings.noise_digest = command.joined()->run.input.value("noise_digest", "");
  }
  const std::vector<SweepPoint> points = pointsOf(gridOf(settings));
  return command.forEachCase(
      points, [&sweep](const SweepPoint& point) { return sweep->measure(point); },
      [&](std::vector<SweepResult>& results) {
        for (std::size_t i = 0; i < results.size(); ++i) results[i].point = points[i];
        return sweepReport(settings, results);
      },
      {{"noise_source", settings.noise_source}, {"noise_digest", settings.noise_digest}});
}

}  // namespace

StudyCommand sweepCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(app, "sweep", "the parameter grid of the paper, evaluated for each law");
  command.quick("few values of each parameter, few frames", [chosen] { chosen->settings.quick = true; });
  command.recordings(chosen->recordings);
  command->add_flag_callback(
      "--untimed", [chosen] { chosen->settings.timed = false; },
      "do not measure the time for one force, the only figure that differs between two runs");
  command.parts();
  command.onRun([chosen](const StudyCommand& self) { return runSweep(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
