// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>

#include <fstream>
#include <iterator>

#include "tools/hapticbench/study_command.h"
#include "tools/hapticbench/sweep/sweep_file.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  SweepSettings settings;
  std::string recordings;
  std::string shard = "1/1";
  std::vector<std::string> merged_files;
};

/// "synthetic" where there are no recordings.
std::string sourceOf(const std::vector<BenchSequence>& sequences) {
  std::vector<std::string> names;
  for (const BenchSequence& sequence : sequences) names.push_back(sequence.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

int merge(const std::vector<std::string>& files, const StudyCommand& command) {
  std::vector<SweepPart> parts;
  for (const std::string& name : files) {
    std::ifstream file(name);
    if (!file) return fail({name, "cannot be read", "check --merge"}, EX_NOINPUT);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    auto part = parseSweep(name, text);
    if (!part) return fail(part.error(), EX_DATAERR);
    parts.push_back(std::move(*part));
  }
  const auto whole = mergeSweep(parts);
  return whole ? command.report(sweepText(*whole), sweepJson(*whole)) : fail(whole.error(), EX_DATAERR);
}

int runPart(const Chosen& chosen, const StudyCommand& command) {
  if (!chosen.merged_files.empty()) return merge(chosen.merged_files, command);
  const bool quick = chosen.settings.quick;
  const std::size_t frames = quick ? 6 : 24;  // of each recording
  const std::size_t sites = quick ? 2 : 6;    // in each recording
  const auto shard = parseShard(chosen.shard);
  if (!shard) return fail(shard.error(), EX_USAGE);
  auto sequences = recordedSequences(chosen.recordings, frames);
  if (!sequences) return fail(sequences.error(), EX_NOINPUT);
  if (sequences->empty()) {
    fmt::print(stderr, "hapticbench: no recordings in {}: noise of a simulated sensor\n", chosen.recordings);
    sequences->push_back(syntheticSequence(frames));
  }
  SweepPart part{.settings = chosen.settings, .shard = *shard};
  part.settings.noise_source = sourceOf(*sequences);
  part.settings.noise_digest = digestOf(*sequences);
  const NoiseProbe noise(std::move(*sequences), sites);
  part.results = runSweep(part.settings, *shard, noise, [](std::size_t done, std::size_t all) {
    showProgress(fmt::format("{} of {} points", done, all));
  });
  return command.report(sweepText(part), sweepJson(part));
}

}  // namespace

StudyCommand sweepCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(app, "sweep", "the parameter grid of the paper, evaluated for each law");
  command.quick("few values of each parameter, few frames", [chosen] { chosen->settings.quick = true; });
  command->add_option("--shard", chosen->shard, "compute part i of n only (1/1)")->type_name("i/n");
  command
      ->add_option("--merge", chosen->merged_files,
                   "join the parts that --shard and --json wrote; computes nothing")
      ->type_name("FILE")
      ->expected(1, 100000);
  command.recordings(chosen->recordings);
  command
      ->add_option("--delay", chosen->settings.delay_ticks,
                   "delay of the force for the stability margin, ms (2)")
      ->check(within(0, 100));
  command->add_flag("--filter", chosen->settings.filter,
                    "measure noise behind the depth filter (8 frames, 2 pixels to each side)");
  command.json();
  command->footer(
      "Points are independent jobs, so that a batch system can spread them over machines:\n"
      "  parallel 'hapticbench sweep --shard {}/8 --json part{}.json' ::: $(seq 8)\n"
      "  sbatch --array=1-8 --wrap 'hapticbench sweep --shard $SLURM_ARRAY_TASK_ID/8 --json "
      "part$SLURM_ARRAY_TASK_ID.json'\n"
      "  hapticbench sweep --merge part*.json");
  command.onRun([chosen](const StudyCommand& self) { return runPart(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
