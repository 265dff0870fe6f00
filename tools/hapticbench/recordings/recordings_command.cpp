// SPDX-License-Identifier: Apache-2.0
#include <sysexits.h>

#include "tools/hapticbench/recordings/recordings_study.h"
#include "tools/hapticbench/study_command.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  RecordingsOptions options;
  std::string recordings;
  std::size_t most_frames = 300;
};

int runRecordings(const Chosen& chosen, const StudyCommand& command) {
  const auto sessions = recordedSequences(chosen.recordings, chosen.most_frames);
  if (!sessions) return fail(sessions.error(), EX_NOINPUT);
  if (sessions->empty()) {
    return fail({chosen.recordings, "holds no recordings",
                 "name a folder whose subfolders are recordings with --recordings"},
                EX_NOINPUT);
  }
  std::vector<SessionResult> results;
  for (const BenchSequence& session : *sessions) {
    if (session.frames.size() >= 2) results.push_back(measureSession(session, chosen.options, showProgress));
  }
  return command.report(recordingsText(results, chosen.options), recordingsJson(results, chosen.options));
}

}  // namespace

StudyCommand recordingsCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  RecordingsOptions& options = chosen->options;
  StudyCommand command(
      app, "recordings",
      "forces on the resting surfaces of recordings, and while people pass in front of them");
  command.quick("one size, one surface per class of distances, two positions that are passed", [&options] {
    options.surfaces.sizes_m = {0.32};
    options.surfaces.most_per_class = 1;
    options.passed_places = 2;
  });
  command.recordings(chosen->recordings);
  command.names("--laws", options.laws, kProxyLawChoices, "all");
  command.millimetres("--sizes", 60, 1000, "sides of the fitted squares, millimetres (160,320,640)",
                      [&options](const std::vector<double>& sizes_m) { options.surfaces.sizes_m = sizes_m; });
  command->add_option("--frames", chosen->most_frames, "frames read of each recording (300)")
      ->check(within(std::size_t{2}, std::size_t{100000}));
  command.json();
  command.onRun([chosen](const StudyCommand& self) { return runRecordings(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
