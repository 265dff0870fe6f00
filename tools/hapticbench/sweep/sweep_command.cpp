// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>

#include "tools/hapticbench/study_command.h"
#include "tools/hapticbench/sweep/sweep_report.h"

namespace hapticd::tools {
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

config::Result<std::vector<BenchSequence>> sequencesOf(const Chosen& chosen) {
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
        return command.report(sweepText(settings, results), sweepJson(settings, results));
      },
      {{"noise_source", settings.noise_source}, {"noise_digest", settings.noise_digest}});
}

}  // namespace

StudyCommand sweepCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(app, "sweep", "the parameter grid of the paper, evaluated for each law");
  command.quick("few values of each parameter, few frames", [chosen] { chosen->settings.quick = true; });
  command.recordings(chosen->recordings);
  command
      ->add_option("--delay", chosen->settings.delay_ticks,
                   "delay of the force for the stability margin, ms (2)")
      ->check(within(0, 100));
  command->add_flag("--filter", chosen->settings.filter,
                    "measure noise behind the depth filter (8 frames, 2 pixels to each side)");
  command->add_flag_callback(
      "--untimed", [chosen] { chosen->settings.timed = false; },
      "do not measure the time for one force, the only figure that differs between two runs");
  command.json();
  command.parts();
  command.onRun([chosen](const StudyCommand& self) { return runSweep(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
