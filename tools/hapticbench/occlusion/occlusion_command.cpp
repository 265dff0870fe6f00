// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/occlusion_study.h"
#include "tools/hapticbench/study_command.h"

namespace hapticd::tools {

StudyCommand occlusionCommand(CLI::App& app) {
  const auto options = std::make_shared<OcclusionOptions>();
  StudyCommand command(
      app, "occlusion",
      "forces while a body passes between the camera and the hand, and where the hand enters from "
      "the side");
  command.quick("one passage each at 1 m, 60 and 100 mm in front of a free and a pressing hand", [options] {
    options->distances_m = {1};
    options->noises = {SceneNoise::none};
    options->gaps_m = {0.06, 0.1};
    options->thicknesses_m = {0.08};
    options->hands = {HandDuringPassage::free, HandDuringPassage::pressing};
    options->one_passage = true;
  });
  command.choices("--parts", options->parts, kAllParts, "all");
  command.names("--laws", options->laws, kProxyLawChoices, "all");
  command.numbers("--distances", options->distances_m, 0.6, 3.8, "of the wall, metres (1,2)");
  command.choices("--noises", options->noises, kAllNoises, "none,sensor");
  command.choices("--hands", options->hands, kAllHands, "all");
  command.millimetres(
      "--gaps", 5, 1000, "from the back of the body to the hand, millimetres (20,40,60,100,200,300)",
      [options](const std::vector<double>& gaps_m) { options->gaps_m = options->few_gaps_m = gaps_m; });
  command.seed(options->seed, "of the noise (1)");
  command.json();
  command.onRun([options](const StudyCommand& self) {
    const OcclusionResult result = measureOcclusion(*options, showProgress);
    return self.report(occlusionText(result), occlusionJson(result));
  });
  return command;
}

}  // namespace hapticd::tools
