// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_command.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <iterator>

#include "tools/hapticbench/sweep/sweep_report.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kFrames = 24;  // of each recording
constexpr std::size_t kSites = 6;    // in each recording

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "hapticbench: {}\n", error.text());
  return status;
}

int report(const SweepPart& part, const std::string& json_file) {
  fmt::print("{}", sweepTable(part));
  if (json_file.empty()) return EX_OK;
  const auto written = writeWholeFile(json_file, sweepJson(part), IfExists::replace);
  return written ? EX_OK : fail(written.error(), EX_CANTCREAT);
}

/// "synthetic" where there are no recordings.
std::string namesOf(const std::vector<BenchSequence>& sequences) {
  std::string names;
  for (const BenchSequence& sequence : sequences) names += (names.empty() ? "" : ", ") + sequence.name;
  return names;
}

void showProgress(std::size_t done, std::size_t all) {
  if (isatty(STDERR_FILENO) == 0) return;
  fmt::print(stderr, "\r{} of {} points{}", done, all, done == all ? "\n" : "");
}

}  // namespace

SweepCommand::SweepCommand(CLI::App& app, const std::string& recordings)
    : command_(app.add_subcommand("sweep", "the paper's parameter grid, evaluated for each law")),
      recordings_(recordings) {
  command_->add_option("--shard", shard_, "compute part i of n only (1/1)")->type_name("i/n");
  command_
      ->add_option("--merge", merged_files_, "join the parts that --shard and --json wrote, compute nothing")
      ->type_name("FILE")
      ->expected(1, 100000);
  command_->add_option("--json", json_file_, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  command_->add_option("--recordings", recordings_,
                       "folder of recordings ($HAPTICD_RECORDINGS, or ../shared/recordings)");
  command_->add_option("--delay", delay_ticks_, "delay of the force for the stability margin, ms (2)")
      ->check(within(0, 100));
  command_->add_flag("--filter", filter_,
                     "measure noise behind the depth filter (8 frames, 2 pixels to each side)");
  command_->add_flag("--quick", quick_, "few values of each parameter, few frames");
  command_->footer(
      "Points are independent jobs, so that a batch system can spread them over machines:\n"
      "  parallel 'hapticbench sweep --shard {}/8 --json part{}.json' ::: $(seq 8)\n"
      "  sbatch --array=1-8 --wrap 'hapticbench sweep --shard $SLURM_ARRAY_TASK_ID/8 --json "
      "part$SLURM_ARRAY_TASK_ID.json'\n"
      "  hapticbench sweep --merge part*.json");
}

int SweepCommand::run() const {
  if (!merged_files_.empty()) return merge();
  const auto shard = parseShard(shard_);
  if (!shard) return fail(shard.error(), EX_USAGE);
  auto sequences = recordedSequences(recordings_, quick_ ? 6 : kFrames);
  if (!sequences) return fail(sequences.error(), EX_NOINPUT);
  if (sequences->empty()) {
    fmt::print(stderr, "hapticbench: no recordings in {}: noise of a simulated sensor\n", recordings_);
    sequences->push_back(syntheticSequence(quick_ ? 6 : kFrames));
  }
  SweepPart part{.name = {},
                 .settings = {quick_, filter_, delay_ticks_, namesOf(*sequences), digestOf(*sequences)},
                 .shard = *shard,
                 .results = {}};
  const NoiseProbe noise(std::move(*sequences), quick_ ? 2 : kSites);
  part.results = runSweep(part.settings, *shard, noise, showProgress);
  return report(part, json_file_);
}

int SweepCommand::merge() const {
  std::vector<SweepPart> parts;
  for (const std::string& name : merged_files_) {
    std::ifstream file(name);
    if (!file) return fail({name, "cannot be read", "check --merge"}, EX_NOINPUT);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    auto part = parseSweep(name, text);
    if (!part) return fail(part.error(), EX_DATAERR);
    parts.push_back(std::move(*part));
  }
  const auto whole = mergeSweep(parts);
  return whole ? report(*whole, json_file_) : fail(whole.error(), EX_DATAERR);
}

}  // namespace hapticd::tools
