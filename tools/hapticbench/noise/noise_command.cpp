// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <limits>

#include "tools/hapticbench/noise/noise_session.h"
#include "tools/hapticbench/noise/noise_statistics.h"
#include "tools/hapticbench/study_command.h"
#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  std::string recording;
  std::string synthetic;  // setting of the synthetic camera
  std::vector<int> windows_px{std::begin(kWindowSides_px), std::end(kWindowSides_px)};
  SessionPart part;
  std::uint32_t seed = 1;
};

config::Result<NoiseSession> sessionOf(const Chosen& chosen) {
  if (chosen.synthetic.empty()) return readSession(chosen.recording, chosen.part);
  const auto parameters =
      sensorParameters(chosen.synthetic == "harsh" ? SceneNoise::harsh : SceneNoise::sensor);
  return madeUpSession(drivers::SensorNoise(chosen.seed, parameters), chosen.part.frames);
}

int runNoise(const Chosen& chosen, const StudyCommand& command) {
  if (chosen.recording.empty() && chosen.synthetic.empty()) {
    return fail({"noise", "there is nothing to measure", "name the folder of a recording, or give --made-up"},
                EX_USAGE);
  }
  const auto session = sessionOf(chosen);
  if (!session) return fail(session.error(), EX_NOINPUT);
  std::vector<NoiseStatistics> statistics;
  for (const int window_px : chosen.windows_px) statistics.push_back(measureNoise(*session, window_px));
  const std::string source =
      chosen.synthetic.empty() ? chosen.recording : fmt::format("the synthetic camera, {}", chosen.synthetic);
  return command.report(noiseText(source, statistics), noiseJson(source, session->frames.size(), statistics));
}

}  // namespace

StudyCommand noiseCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(app, "noise", "statistics of the depth noise of a scene at rest");
  CLI::Option* recording =
      command->add_option("recording", chosen->recording,
                          "folder of an unpacked recording whose camera is at rest most of the time");
  command->add_option("--made-up", chosen->synthetic, "of the synthetic camera instead: recorded or harsh")
      ->check(CLI::IsMember({"recorded", "harsh"}))
      ->excludes(recording);
  command.numbers("--windows", chosen->windows_px, 16, 240, "sides of the windows, pixels (24,40,64,96)");
  command->add_option("--first", chosen->part.first, "first frame of the recording that is used (0)")
      ->check(within(0, std::numeric_limits<int>::max() - 600));
  command->add_option("--frames", chosen->part.frames, "number of frames that are used (60)")
      ->check(within(kFewestFrames, 600));
  command.seed(chosen->seed, "of the synthetic camera's noise (1)");
  command.json();
  command.onRun([chosen](const StudyCommand& self) { return runNoise(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
