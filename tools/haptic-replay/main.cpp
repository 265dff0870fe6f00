// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "config/parameter_table.h"
#include "config/program.h"
#include "config/yaml_loader.h"
#include "tools/haptic-replay/replay.h"
#include "tools/haptic-replay/trace_replay.h"
#include "tools/lib/options/output_file.h"
#include "tools/lib/options/within.h"
#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

struct Options {
  std::string trace;
  std::string config;
  std::vector<std::string> overrides;
  std::string depth;
  std::string hip;
  std::string out;
  Stage stage = Stage::law;
  double handle_delay_ms = 0;
  bool full_model = false;
};

int fail(const std::vector<config::Error>& errors, int status) {
  for (const config::Error& error : errors) {
    std::fputs(fmt::format("haptic-replay: {}\n", error.text()).c_str(), stderr);
  }
  return status;
}

std::optional<config::Error> timeGoesBack(const std::vector<HipSample>& samples) {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i].time_s >= samples[i - 1].time_s) continue;
    return config::Error{fmt::format("sample {}", i + 1),
                         fmt::format("t_s {} is before that of the sample before, {}", samples[i].time_s,
                                     samples[i - 1].time_s),
                         "sort the file by time, or use --stage law"};
  }
  return std::nullopt;
}

config::Result<std::string> forcesOf(Replay& replay, const std::vector<HipSample>& samples) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,points,frame\n");
  for (const HipSample& sample : samples) {
    const auto felt = replay.feel(sample);
    if (!felt) return std::unexpected(felt.error());
    const rt::Vec3& p = sample.hip_m_in_world;
    const rt::Vec3& f = felt->force_n_in_world;
    fmt::format_to(std::back_inserter(text), "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{},{}\n",
                   sample.time_s, p.x, p.y, p.z, f.x, f.y, f.z, felt->points_used, felt->frame);
  }
  return fmt::to_string(text);
}

int replayFile(const Options& options) {
  std::vector<std::string> overrides = options.overrides;
  if (options.full_model) overrides.emplace_back("grid.extent=frame");
  const auto settings = config::loadSettings(options.config, overrides);
  if (!settings) return fail(settings.error(), EX_CONFIG);
  const auto samples = readHipCsv(options.hip);
  if (!samples) return fail(samples.error(), EX_DATAERR);
  if (options.stage == Stage::command) {
    if (const auto error = timeGoesBack(*samples)) return fail({*error}, EX_DATAERR);
  }
  const auto source = DepthSource::open(options.depth);
  if (!source) return fail({source.error()}, EX_NOINPUT);

  Replay replay(*settings, *source, options.stage, options.handle_delay_ms * 1e-3);
  const auto text = forcesOf(replay, *samples);
  if (!text) return fail({text.error()}, EX_DATAERR);
  const auto written = writeWholeFile(options.out, *text, IfExists::replace);
  if (!written) return fail({written.error()}, EX_CANTCREAT);
  std::fputs(fmt::format("{} forces, {} scenes modelled\n", samples->size(), replay.models()).c_str(),
             stdout);
  return EX_OK;
}

/// One line per tick that was computed again.
class ForceTable {
 public:
  void add(const rt::Tick& recorded, const rt::Tick& computed) {
    const rt::Vec3& was = recorded.command_force_n_in_world;
    const rt::Vec3& is = computed.command_force_n_in_world;
    fmt::format_to(std::back_inserter(text_), "{},{:.9f},{},{},{},{},{},{},{}\n", recorded.number,
                   static_cast<double>(recorded.planned_ns) * 1e-9, was.x, was.y, was.z, is.x, is.y, is.z,
                   rt::norm(is - was));
  }
  std::string text() const {
    return "tick,t_s,recorded_fx_n,recorded_fy_n,recorded_fz_n,fx_n,fy_n,fz_n,difference_n\n" +
           fmt::to_string(text_);
  }

 private:
  fmt::memory_buffer text_;
};

/// "3..5, 9, ...": at most so many stretches.
std::string stretchesOf(const std::set<std::uint64_t>& numbers) {
  constexpr int kMostStretches = 20;
  std::string text;
  int stretches = 0;
  for (auto number = numbers.begin(); number != numbers.end();) {
    if (++stretches > kMostStretches) return text + ", ...";
    const std::uint64_t first = *number;
    std::uint64_t last = first;
    while (++number != numbers.end() && *number == last + 1) ++last;
    text += text.empty() ? "" : ", ";
    text += first == last ? fmt::format("{}", first) : fmt::format("{}..{}", first, last);
  }
  return text;
}

std::string leftOutText(const TraceComparison& comparison) {
  constexpr std::array<const char*, kLeftOutReasons> kReasons{
      "before the first recorded depth frame",
      "their depth frame is not recorded",
      "filter or fusion remember what is not recorded",
      "their scene is not in the trace",
      "their parameters are not in the trace",
      "before the first snapshot of the core, or the next one after a gap"};
  std::string text;
  for (std::size_t reason = 0; reason < kLeftOutReasons; ++reason) {
    if (comparison.left_out[reason] == 0) continue;
    text += fmt::format("left out {} ticks: {}\n", comparison.left_out[reason], kReasons[reason]);
  }
  if (!comparison.missing_frames.empty()) {
    text += fmt::format("depth frames that are not recorded: {} ({})\n", comparison.missing_frames.size(),
                        stretchesOf(comparison.missing_frames));
  }
  return text;
}

void print(const TraceComparison& comparison) {
  const std::string where =
      comparison.worst_tick == 0 ? "" : fmt::format(" at tick {}", comparison.worst_tick);
  const std::uint64_t left_out =
      std::accumulate(comparison.left_out.begin(), comparison.left_out.end(), std::uint64_t{0});
  std::fputs(fmt::format("{} ticks computed again ({} in contact, {} scenes modelled), {} left out\n"
                         "{}different: {} ticks\n"
                         "largest difference: {:g} N of the commanded force{}, {:g} N of the law's\n",
                         comparison.ticks, comparison.in_contact, comparison.models, left_out,
                         leftOutText(comparison), comparison.different, comparison.largest_difference_n,
                         where, comparison.largest_law_difference_n)
                 .c_str(),
             stdout);
}

int replayTrace(const Options& options) {
  auto replay = TraceReplay::open(options.trace, options.depth);
  if (!replay) return fail({replay.error()}, EX_NOINPUT);
  ForceTable table;
  TraceReplay::OnTick on_tick;
  if (!options.out.empty()) {
    on_tick = [&table](const rt::Tick& recorded, const rt::Tick& computed) { table.add(recorded, computed); };
  }
  const auto comparison = replay->run(on_tick);
  if (!comparison) return fail({comparison.error()}, EX_DATAERR);
  if (!options.out.empty()) {
    const auto written = writeWholeFile(options.out, table.text(), IfExists::replace);
    if (!written) return fail({written.error()}, EX_CANTCREAT);
  }
  print(*comparison);
  return comparison->different == 0 ? EX_OK : EXIT_FAILURE;
}

int run(int argc, char** argv) {
  CLI::App app{
      "haptic-replay: the forces that hapticd's core computes for a recorded scene and given HIP positions.\n"
      "Times count from the first depth frame. A single image holds for all times. At the stage `command`\n"
      "the replay begins engaged, and each sample is one step of damping, passivity control and the safety\n"
      "chain; the velocity is estimated from the samples as the drivers do it.\n"
      "With --trace: computes the ticks of a trace again from the depth recorded in it, and compares. Ticks\n"
      "that depend on something that was not recorded are left out and counted."};
  app.footer(
      "Exit status: 0 done, 1 a force differs from the trace's, 64 usage, 65 bad HIP file, depth frame or\n"
      "trace, 66 no depth or trace, 73 no output, 78 configuration.");
  Options options;
  const std::map<std::string, Stage> stages{{"law", Stage::law}, {"command", Stage::command}};
  CLI::Option* const trace =
      app.add_option("--trace", options.trace, "trace with depth; its settings are taken from it")
          ->type_name("FILE");
  CLI::Option* const config =
      app.add_option("-c,--config", options.config, "configuration file (YAML)")->type_name("FILE");
  app.add_option("-s,--set", options.overrides, "set a parameter; may be repeated")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("--depth", options.depth,
                 "folder of a recording, or one .pgm file; with --trace the folder of a recording, for a "
                 "trace without\n"
                 "depth inside; by default the one beside it")
      ->type_name("DIR_OR_PGM");
  CLI::Option* const hip =
      app.add_option("--hip", options.hip, "HIP positions in the world frame: t_s,x_m,y_m,z_m")
          ->type_name("CSV");
  app.add_option("--out", options.out, "where the forces go; needed without --trace")
      ->type_name("CSV")
      ->check(endsIn(".csv"));
  trace->excludes(config)->excludes(hip);
  app.add_option("--stage", options.stage, "law (default) or command")
      ->type_name("STAGE")
      ->transform(CLI::CheckedTransformer(stages));
  app.add_option("--handle-delay-ms", options.handle_delay_ms,
                 "delay that the handle's driver would report, at the stage command (0)")
      ->type_name("MS")
      ->check(within(0.0, 1000.0));
  app.add_flag("--full-model", options.full_model, "model whole frames, not only the HIP's reach");
  app.set_version_flag("-V,--version", std::string("haptic-replay ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return config::endWithoutWork(app, error, EX_USAGE);
  }
  if (!options.trace.empty()) return replayTrace(options);
  for (const auto& [name, given] : {std::pair{"--config", options.config},
                                    {"--depth", options.depth},
                                    {"--hip", options.hip},
                                    {"--out", options.out}}) {
    if (given.empty())
      return fail({{name, "is required without --trace", "see haptic-replay --help"}}, EX_USAGE);
  }
  return replayFile(options);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::config::runProgram("haptic-replay", [&] { return hapticd::tools::run(argc, argv); });
}
