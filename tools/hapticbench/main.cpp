// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "config/program.h"
#include "rt/realtime_thread.h"
#include "tools/hapticbench/accuracy/accuracy_command.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/jitter/jitter_command.h"
#include "tools/hapticbench/noise/noise_command.h"
#include "tools/hapticbench/occlusion/occlusion_command.h"
#include "tools/hapticbench/pareto/pareto_command.h"
#include "tools/hapticbench/recordings/recordings_command.h"
#include "tools/hapticbench/speed.h"
#include "tools/hapticbench/speed_report.h"
#include "tools/hapticbench/stability/stability_command.h"
#include "tools/hapticbench/strokes/strokes_command.h"
#include "tools/hapticbench/sweep/sweep_command.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "hapticbench: {}\n", error.text());
  return status;
}

std::string defaultRecordings() {
  const char* folder = std::getenv("HAPTICD_RECORDINGS");
  return folder != nullptr ? folder : "../shared/recordings";
}

int speed(const SpeedOptions& options, int wanted_cpu, const std::string& recordings,
          const std::string& json_file) {
  const int cpu = rt::pinToCpu(wanted_cpu);
  auto recorded = recordedScenes(recordings);
  if (!recorded) return fail(recorded.error(), EX_NOINPUT);
  if (recorded->empty())
    fmt::print(stderr, "hapticbench: no recordings in {}: synthetic scene only\n", recordings);
  std::vector<SceneSpeed> results{measureSpeed(syntheticScene(), options)};
  for (const BenchScene& scene : *recorded) results.push_back(measureSpeed(scene, options));
  fmt::print("{}", speedTable(results, cpu));
  if (json_file.empty()) return EX_OK;
  const auto written = writeWholeFile(json_file, speedJson(results, cpu), IfExists::replace);
  return written ? EX_OK : fail(written.error(), EX_CANTCREAT);
}

int run(int argc, char** argv) {
  CLI::App app{
      "hapticbench: hapticd's core measured beside other ways to do the same, speed and error together"};
  app.require_subcommand(1);
  app.set_version_flag("-V,--version", std::string("hapticbench ") + HAPTICD_VERSION);
  SpeedOptions options;
  int cpu = -1;
  std::string recordings = defaultRecordings();
  std::string json_file;
  CLI::App* command =
      app.add_subcommand("speed", "time to model a frame and to compute a force, beside nanoflann");
  command->add_option("--positions", options.positions, "HIP positions (1000)")->check(within(100, 1000000));
  command->add_option("--frames", options.frames, "whole frames modelled (30)")->check(within(3, 10000));
  command->add_option("--cpu", cpu, "CPU to be pinned to (the last one)")->check(within(-1, 1023));
  command->add_option("--recordings", recordings,
                      "folder of recordings ($HAPTICD_RECORDINGS, or ../shared/recordings)");
  command->add_option("--json", json_file, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  AccuracyCommand accuracy(app);
  JitterCommand jitter(app);
  NoiseCommand noise(app);
  OcclusionCommand occlusion(app);
  ParetoCommand pareto(app, defaultRecordings());
  RecordingsCommand recorded(app, defaultRecordings());
  StabilityCommand stability(app);
  StrokesCommand strokes(app);
  SweepCommand sweep(app, defaultRecordings());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return config::endWithoutWork(app, error, EX_USAGE);
  }
  if (accuracy.chosen()) return accuracy.run();
  if (jitter.chosen()) return jitter.run();
  if (noise.chosen()) return noise.run();
  if (occlusion.chosen()) return occlusion.run();
  if (pareto.chosen()) return pareto.run();
  if (recorded.chosen()) return recorded.run();
  if (stability.chosen()) return stability.run();
  if (strokes.chosen()) return strokes.run();
  if (sweep.chosen()) return sweep.run();
  return speed(options, cpu, recordings, json_file);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::config::runProgram("hapticbench", [&] { return hapticd::tools::run(argc, argv); });
}
