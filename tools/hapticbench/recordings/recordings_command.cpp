// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/recordings_command.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <cstdio>

#include "config/error.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/recordings/recordings_report.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {

RecordingsCommand::RecordingsCommand(CLI::App& app, const std::string& recordings)
    : command_(app.add_subcommand(
          "recordings", "forces on the resting surfaces of recordings, and while people pass them")),
      recordings_(recordings) {
  command_
      ->add_option("--recordings", recordings_,
                   "folder of recordings ($HAPTICD_RECORDINGS, or ../shared/recordings)")
      ->type_name("FOLDER");
  command_->add_option("--laws", laws_, "of auto, surface, proxy (all)")
      ->delimiter(',')
      ->check(CLI::IsMember({"auto", "surface", "proxy"}));
  command_->add_option("--sizes", sizes_mm_, "sides of the fitted squares, millimetres (160,320,640)")
      ->delimiter(',')
      ->check(within(60.0, 1000.0));
  command_->add_option("--frames", most_frames_, "frames read of each recording (300)")
      ->check(within(2, 100000));
  command_->add_flag("--quick", quick_,
                     "one size, one surface per class of distances, two places that are passed");
  command_->add_option("--json", json_file_, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
}

RecordingsOptions RecordingsCommand::options() const {
  RecordingsOptions options;
  if (quick_) {
    options.surfaces.sizes_m = {0.32};
    options.surfaces.most_per_class = 1;
    options.passed_places = 2;
  }
  if (!laws_.empty()) {
    options.laws.clear();
    for (const std::string& law : laws_) options.laws.push_back(shippedLawNamed(law));
  }
  if (!sizes_mm_.empty()) {
    options.surfaces.sizes_m.clear();
    for (const double size_mm : sizes_mm_) options.surfaces.sizes_m.push_back(size_mm / 1000);
  }
  return options;
}

int RecordingsCommand::run() const {
  const auto fail = [](const config::Error& error, int status) {
    fmt::print(stderr, "hapticbench: {}\n", error.text());
    return status;
  };
  const auto sessions = recordedSequences(recordings_, static_cast<std::size_t>(most_frames_));
  if (!sessions) return fail(sessions.error(), EX_NOINPUT);
  if (sessions->empty())
    return fail({recordings_, "holds no recordings", "name another folder with --recordings"}, EX_NOINPUT);
  const bool watched = isatty(STDERR_FILENO) != 0;
  const auto progress = [watched](const std::string& what) {
    if (watched) fmt::print(stderr, "\r{:<70}", what);
  };
  std::vector<SessionResult> results;
  for (const BenchSequence& session : *sessions) {
    if (session.frames.size() < 2) continue;
    results.push_back(measureSession(session, options(), progress));
  }
  progress("");
  fmt::print("{}", recordingsTable(results, options()));
  if (json_file_.empty()) return EX_OK;
  const auto written = writeWholeFile(json_file_, recordingsJson(results, options()), IfExists::replace);
  return written ? EX_OK : fail(written.error(), EX_CANTCREAT);
}

}  // namespace hapticd::tools
