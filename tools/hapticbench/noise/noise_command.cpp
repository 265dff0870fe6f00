// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "drivers/camera/recorded/recording_reader.h"
#include "tools/hapticbench/noise/noise_session.h"
#include "tools/hapticbench/noise/noise_statistics.h"
#include "tools/hapticbench/study_command.h"
#include "tools/lib/depth_noise/depth_noise.h"
#include "tools/lib/depth_noise/noise_text.h"
#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  std::string recording;
  std::string synthetic;        // setting of the synthetic camera
  std::vector<int> windows_px;  // empty: kWindowSides_px
  SessionPart part;
  std::uint32_t seed = 1;
};

config::Result<NoiseSession> sessionOf(const Chosen& chosen) {
  if (chosen.synthetic.empty()) return readSession(chosen.recording, chosen.part);
  const auto parameters =
      sensorParameters(chosen.synthetic == "harsh" ? SceneNoise::harsh : SceneNoise::sensor);
  return madeUpSession(drivers::SensorNoise(chosen.seed, parameters), chosen.part.frames);
}

/// The depths of a recording of any camera that are measured: all that the camera itself delivers.
constexpr drivers::DepthLimits kAllDepths{0.001, 100};

/// Measures a recording with camera.yaml, in metres and not in raw units as a Kinect's.
int runAnyCamera(const Chosen& chosen, const drivers::RecordingReader& reader, const StudyCommand& command) {
  const std::size_t recorded = reader.frames().size();
  const auto part = framesOf(chosen.recording, recorded, chosen.part);
  if (!part) return fail(part.error(), EX_NOINPUT);
  DepthNoise noise;
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t i = part->begin; i < part->end; ++i) {
    if (const auto read = reader.read(i, *frame); !read) return fail(read.error(), EX_NOINPUT);
    noise.add(*frame);
  }
  const rt::DepthModelParameters& camera = *reader.camera();
  const DepthNoiseReport report = noise.report();
  const std::string text =
      fmt::format("{}: {} frames of {} x {} pixels, {:.1f} % holes\n", chosen.recording, report.frames,
                  camera.width_px, camera.height_px, 100 * report.share_of_holes) +
      textOf(report, camera.principle);
  nlohmann::ordered_json document{
      {"source", chosen.recording}, {"frames", report.frames}, {"shareOfHoles", report.share_of_holes}};
  addTo(document, report, camera.principle);
  return command.report(text, document.dump(2) + "\n");
}

int runNoise(const Chosen& chosen, const StudyCommand& command) {
  if (chosen.recording.empty() && chosen.synthetic.empty()) {
    return fail({"noise", "there is nothing to measure", "name the folder of a recording, or give --made-up"},
                EX_USAGE);
  }
  if (chosen.synthetic.empty()) {
    const auto reader = drivers::RecordingReader::open(chosen.recording, kAllDepths);
    if (!reader) return fail(reader.error(), EX_NOINPUT);
    if (reader->camera()) {
      if (chosen.windows_px.empty()) return runAnyCamera(chosen, *reader, command);
      return fail({"--windows", "is for recordings of a Kinect v1", "leave it out"}, EX_USAGE);
    }
  }
  const auto session = sessionOf(chosen);
  if (!session) return fail(session.error(), EX_NOINPUT);
  std::vector<NoiseStatistics> statistics;
  std::vector<int> windows_px = chosen.windows_px;
  if (windows_px.empty()) windows_px.assign(std::begin(kWindowSides_px), std::end(kWindowSides_px));
  for (const int window_px : windows_px) statistics.push_back(measureNoise(*session, window_px));
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
