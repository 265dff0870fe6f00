// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <cmath>
#include <memory>

#include "drivers/camera/recorded/recording_reader.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/noise.h"
#include "tools/lib/depth_noise/depth_noise.h"
#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {
namespace {

Json figureOf(double figure) {
  return std::isnan(figure) ? Json() : Json(figure);
}

Json objectOf(const Estimate& estimate) {
  return {{"value", figureOf(estimate.value)},
          {"spread", figureOf(estimate.spread)},
          {"standard_error", figureOf(estimate.standard_error)}};
}

Columns<NoiseStatistics> columns() {
  using Row = NoiseStatistics;
  Columns<Row> list{{"/window_px", "window px", 0, &Row::window_px},
                    {"/windows", "measured", 0, &Row::windows},
                    {"/with_holes", "holes", 0, &Row::with_holes},
                    {"/not_smooth", "rough", 0, &Row::not_smooth},
                    {"/moving", "moving", 0, &Row::moving}};
  const auto add = [&list](const char* key, const char* heading, Estimate Row::*estimate) {
    list.push_back({key, "", 0, [estimate](const Row& s) { return objectOf(s.*estimate); }});
    list.push_back({"", heading, 3, [estimate](const Row& s) { return figureOf((s.*estimate).value); }});
  };
  const auto addList = [&list](const char* key, std::vector<Estimate> Row::*estimates) {
    list.push_back({key, "", 0, [estimates](const Row& s) {
                      Json lags = Json::array();
                      for (const Estimate& estimate : s.*estimates) lags.push_back(objectOf(estimate));
                      return lags;
                    }});
  };
  add("/temporal_raw", "temporal", &Row::temporal_raw);
  add("/standing_raw", "static", &Row::static_raw);
  add("/halves_correlation", "halves", &Row::halves_correlation);
  add("/left_after_8_raw", "after 8", &Row::left_after_8_raw);
  addList("/in_time_raw2", &Row::in_time);
  addList("/in_space_raw2", &Row::in_space);
  return list;
}

struct Chosen {
  std::string recording;
  std::string synthetic;  ///< setting of the synthetic camera
  int frames = 60;
};

/// Of a Kinect v1 or the synthetic one, in raw units.
Report reportOf(const std::string& source, const NoiseSession& session) {
  std::vector<NoiseStatistics> statistics;
  for (const int window_px : kWindowSides_px) statistics.push_back(measureNoise(session, window_px));
  Report report;
  report.note("source", source);
  report.note("frames", session.frames.size());
  report.table("windows", fmt::format("noise of {}, raw units\n", source), columns(), statistics);
  return report;
}

/// Measures a recording with camera.yaml, in metres and not in raw units as a Kinect's.
int runAnyCamera(const Chosen& chosen, const drivers::RecordingReader& reader, const StudyCommand& command) {
  const auto frames = framesOf(chosen.recording, reader.frames().size(), chosen.frames);
  if (!frames) return fail(frames.error(), EX_NOINPUT);
  DepthNoise noise;
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t i = 0; i < *frames; ++i) {
    if (const auto read = reader.read(i, *frame); !read) return fail(read.error(), EX_NOINPUT);
    noise.add(*frame);
  }
  const rt::DepthModelParameters& camera = *reader.camera();
  const DepthNoiseReport measured = noise.report();
  Report report;
  report.say(fmt::format("{}: {} frames of {} x {} pixels, {:.1f} % holes\n", chosen.recording,
                         measured.frames, camera.width_px, camera.height_px, 100 * measured.share_of_holes));
  report.say(textOf(measured, camera.principle));
  Json document{
      {"source", chosen.recording}, {"frames", measured.frames}, {"shareOfHoles", measured.share_of_holes}};
  addTo(document, measured, camera.principle);
  for (const auto& [key, value] : document.items()) report.note(key, value);
  return command.report(report);
}

int runNoise(const Chosen& chosen, const StudyCommand& command) {
  if (!chosen.synthetic.empty()) {
    const auto noise = sensorParameters(chosen.synthetic == "harsh" ? SceneNoise::harsh : SceneNoise::sensor);
    return command.report(reportOf(fmt::format("the synthetic camera, {}", chosen.synthetic),
                                   madeUpSession(drivers::SensorNoise(1, noise), chosen.frames)));
  }
  if (chosen.recording.empty()) {
    return fail({"noise", "there is nothing to measure", "name the folder of a recording, or give --made-up"},
                EX_USAGE);
  }
  constexpr drivers::DepthLimits kAllThatACameraDelivers{0.001, 100};
  const auto reader = drivers::RecordingReader::open(chosen.recording, kAllThatACameraDelivers);
  if (!reader) return fail(reader.error(), EX_NOINPUT);
  if (reader->camera()) return runAnyCamera(chosen, *reader, command);
  const auto session = readSession(chosen.recording, chosen.frames);
  return session ? command.report(reportOf(chosen.recording, *session)) : fail(session.error(), EX_NOINPUT);
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
  command->add_option("--frames", chosen->frames, "number of frames that are used (60)")
      ->check(within(kMinFrames, 600));
  command.onRun([chosen](const StudyCommand& self) { return runNoise(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
