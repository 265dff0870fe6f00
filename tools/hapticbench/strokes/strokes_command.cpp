// SPDX-License-Identifier: Apache-2.0
#include <sysexits.h>

#include <algorithm>
#include <cstdlib>

#include "tools/hapticbench/strokes/strokes_report.h"
#include "tools/hapticbench/study_command.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  StrokesOptions options;
  bool check = false;
};

}  // namespace

StudyCommand strokesCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StrokesOptions& options = chosen->options;
  StudyCommand command(app, "strokes",
                       "strokes over known bodies: error, lost contact, lag, forces that nothing explains");
  command.quick("one stroke each over a plane, a rod and an edge at 1 m", [&options] {
    options.scenes = {"plane0", "rod40", "over_edge"};
    options.distances_m = {1};
    options.variants = 1;
  });
  command.names("--laws", options.laws, kLawChoices, "proxy,surface,auto");
  command.names("--scenes", options.scenes, namesOf(strokeScenes()), "all");
  command.numbers("--distances", options.distances_m, 0.45, 3.5, "from the camera, metres (0.6,1,2)");
  command.choices("--noises", options.noises, kAllNoises, "none,sensor,harsh");
  command.millimetres("--depth", 1, 40, "of the strokes below the surface, millimetres (8)",
                      [&options](const std::vector<double>& depths_m) { options.depth_m = depths_m.back(); });
  command
      ->add_option("--latency", options.latency_ms,
                   "of the camera, as camera.latency_s has it, milliseconds (0)")
      ->check(within(0.0, 200.0));
  command
      ->add_option("--repeats", options.repeats,
                   "of each stroke, at other positions and with other noise (1)")
      ->check(within(1, 1000));
  command.seed(options.seed, "of the positions and of the noise (1)");
  command->add_flag("--each", options.each, "one row for each stroke of a scene");
  command->add_flag("--check", chosen->check, "exit status 1 where a requirement is not kept");
  command.json();
  command.onRun([chosen](const StudyCommand& self) {
    const std::vector<StrokesRow> rows = measureStrokes(chosen->options, showProgress);
    const int status = self.report(strokesText(rows), strokesJson(rows));
    const bool kept = std::ranges::all_of(requirementsOf(rows), &Requirement::kept);
    return status == EX_OK && chosen->check && !kept ? EXIT_FAILURE : status;
  });
  return command;
}

}  // namespace hapticd::tools
