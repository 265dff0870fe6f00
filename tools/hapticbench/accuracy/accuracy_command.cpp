// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/accuracy_report.h"
#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/hapticbench/study_command.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  AccuracyOptions options;
  std::vector<rt::ForceLaw> laws{kAllLaws.begin(), kAllLaws.end()};
  std::vector<std::string> filters{"off", "on"};

  AccuracyOptions effective() const {
    AccuracyOptions result = options;
    std::erase_if(result.settings, [this](const LawSetting& setting) {
      const bool has_filter = setting.law != rt::ForceLaw::surface;
      return std::ranges::find(laws, setting.law) == laws.end() ||
             (has_filter && std::ranges::find(filters, setting.filtered ? "on" : "off") == filters.end());
    });
    return result;
  }
};

}  // namespace

StudyCommand accuracyCommand(CLI::App& app) {
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
  command.names("--filters", chosen->filters, {"off", "on"}, "both; of the laws on points");
  command.seed(options.seed, "of the positions and of the noise (1)");
  command.json();
  command.parts();
  command.onRun([chosen](const StudyCommand& self) {
    const AccuracyOptions effective = chosen->effective();
    return self.forEachCase(
        casesOf(effective), [&](const AccuracyCase& one) { return measureCase(one, effective); },
        [&self](const std::vector<std::vector<AccuracyRow>>& cases) {
          std::vector<AccuracyRow> rows;
          for (const auto& of_case : cases) rows.insert(rows.end(), of_case.begin(), of_case.end());
          return self.report(accuracyText(rows), accuracyJson(rows));
        });
  });
  return command;
}

}  // namespace hapticd::tools
