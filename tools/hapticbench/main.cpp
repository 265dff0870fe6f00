#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "rt/realtime_thread.h"
#include "tools/hapticbench/accuracy/accuracy_command.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/jitter/jitter_command.h"
#include "tools/hapticbench/pareto/pareto_command.h"
#include "tools/hapticbench/speed.h"
#include "tools/hapticbench/speed_report.h"
#include "tools/hapticbench/stability/stability_command.h"
#include "tools/hapticbench/sweep/sweep_command.h"

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
  if (recorded->empty()) fmt::print(stderr, "hapticbench: no recordings in {}: synthetic scene only\n", recordings);
  std::vector<SceneSpeed> results{measureSpeed(syntheticScene(), options)};
  for (const BenchScene& scene : *recorded) results.push_back(measureSpeed(scene, options));
  fmt::print("{}", speedTable(results, cpu));
  if (json_file.empty()) return EX_OK;
  std::ofstream out(json_file);
  out << speedJson(results, cpu) << std::flush;
  return out ? EX_OK : fail({json_file, "cannot be written", "check --json"}, EX_CANTCREAT);
}

int run(int argc, char** argv) {
  CLI::App app{"hapticbench: hapticd's core measured beside other ways to do the same, speed and error together"};
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("hapticbench ") + HAPTICD_VERSION);
  SpeedOptions options;
  int cpu = -1;
  std::string recordings = defaultRecordings();
  std::string json_file;
  CLI::App* command = app.add_subcommand("speed", "time to model a frame and to compute a force, beside nanoflann");
  command->add_option("--positions", options.positions, "HIP positions (1000)")->check(CLI::Range(100, 1000000));
  command->add_option("--frames", options.frames, "whole frames modelled (30)")->check(CLI::Range(3, 10000));
  command->add_option("--cpu", cpu, "CPU to be pinned to (the last one)")->check(CLI::Range(-1, 1023));
  command->add_option("--recordings", recordings, "folder of recordings ($HAPTICD_RECORDINGS, or ../shared/recordings)");
  command->add_option("--json", json_file, "write the result there too")->type_name("FILE");
  AccuracyCommand accuracy(app);
  JitterCommand jitter(app);
  ParetoCommand pareto(app, defaultRecordings());
  StabilityCommand stability(app);
  SweepCommand sweep(app, defaultRecordings());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EX_OK : EX_USAGE;
  }
  if (accuracy.chosen()) return accuracy.run();
  if (jitter.chosen()) return jitter.run();
  if (pareto.chosen()) return pareto.run();
  if (stability.chosen()) return stability.run();
  if (sweep.chosen()) return sweep.run();
  return speed(options, cpu, recordings, json_file);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) { return hapticd::tools::run(argc, argv); }
