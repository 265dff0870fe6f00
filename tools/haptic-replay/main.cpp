// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "config/base/counted.h"
#include "config/base/error.h"
#include "config/base/file_content.h"
#include "config/base/program.h"
#include "config/base/whole_file.h"
#include "config/settings/fixture_settings.h"
#include "config/settings/label_image.h"
#include "config/settings/parameter_table.h"
#include "config/yaml_loader.h"
#include "tools/haptic-replay/replay.h"
#include "tools/haptic-replay/trace_replay.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/parts/fields.h"
#include "tools/lib/parts/parts.h"

namespace hapticd::tools {
namespace {

/// A trace of a folder whose traces are computed again, one after the other, or divided over computers.
struct TraceFile {
  std::string name;  ///< without folder
  std::uint64_t bytes = 0;
};

/// What became of one trace.
struct TraceOutcome {
  std::string name;            ///< of the file, without folder
  std::string error;           ///< why it could not be replayed; empty: it was
  TraceComparison comparison;  ///< of all ticks up to the error
};

auto fieldsOf(Is<TraceOutcome> auto& outcome) {
  auto& [name, error, comparison] = outcome;
  return std::tie(name, error, comparison);
}

namespace fs = std::filesystem;

std::unexpected<base::Error> unreadable(const fs::path& folder, const std::error_code& error) {
  return std::unexpected(
      base::Error{folder.string(), "cannot be read: " + error.message(), "name a folder of traces"});
}

base::Result<TraceComparison> replayInto(ForceTable* table, const fs::path& trace) {
  auto replay = TraceReplay::open(trace);
  if (!replay) return std::unexpected(replay.error());
  TraceReplay::OnTick on_tick;
  if (table != nullptr) {
    on_tick = [table](const rt::Tick& recorded, const rt::Tick& computed) { table->add(recorded, computed); };
  }
  return replay->run(on_tick);
}

/// The finished traces (*.mcap) of the folder in the order of their names.
/// Errors: the folder cannot be read, or holds none.
base::Result<std::vector<TraceFile>> tracesIn(const fs::path& folder) {
  std::error_code error;
  std::vector<TraceFile> traces;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code vanished;
    const std::uint64_t bytes = entry->file_size(vanished);
    if (entry->path().extension() == ".mcap" && !vanished)
      traces.push_back({entry->path().filename().string(), bytes});
  }
  if (error) return unreadable(folder, error);
  if (traces.empty()) {
    return base::failure(folder.string(), "holds no finished trace (*.mcap)",
                         "hapticctl trace stop finishes one");
  }
  std::ranges::sort(traces, {}, &TraceFile::name);
  return traces;
}

/// Replays a trace and, unless `out` is empty, writes the forces to `out`/NAME.csv.
TraceOutcome replayOne(const fs::path& trace, const fs::path& out) {
  TraceOutcome outcome{.name = trace.filename().string(), .error = {}, .comparison = {}};
  ForceTable table;
  const auto comparison = replayInto(out.empty() ? nullptr : &table, trace);
  if (!comparison) {
    outcome.error = comparison.error().text();
    return outcome;
  }
  outcome.comparison = *comparison;
  if (out.empty()) return outcome;
  const fs::path csv = out / trace.stem().concat(".csv");
  if (const auto written = base::writeWholeFile(csv, table.text(), base::IfExists::replace); !written)
    outcome.error = written.error().text();
  return outcome;
}

/// Every trace, and all together, for people and for programs.
std::string outcomesText(const std::vector<TraceOutcome>& outcomes) {
  std::string text;
  std::size_t replayed = 0;
  TraceComparison all;
  std::uint64_t left_out = 0;
  std::string worst;
  for (const TraceOutcome& outcome : outcomes) {
    const TraceComparison& one = outcome.comparison;
    text += outcome.name + "\n";
    text += outcome.error.empty() ? comparisonText(one) : "not replayed: " + outcome.error + "\n";
    text += "\n";
    if (!outcome.error.empty()) continue;
    ++replayed;
    all.ticks += one.ticks;
    all.different += one.different;
    left_out += leftOut(one);
    if (one.worst_tick != 0 && one.largest_difference_n >= all.largest_difference_n) {
      all.largest_difference_n = one.largest_difference_n;
      worst = fmt::format(" in {} at tick {}", outcome.name, one.worst_tick);
    }
  }
  return text + fmt::format(
                    "{} traces, {} of them replayed: {} ticks computed again, {} left out\n"
                    "different: {} ticks\n"
                    "largest difference: {:g} N of the commanded force{}\n",
                    outcomes.size(), replayed, all.ticks, left_out, all.different, all.largest_difference_n,
                    worst);
}

std::string outcomesJson(const std::vector<TraceOutcome>& outcomes) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& [name, error, one] : outcomes) {
    auto& row = list.emplace_back(nlohmann::ordered_json{{"name", name}});
    if (!error.empty()) {
      row["error"] = error;
      continue;
    }
    row["ticks"] = one.ticks;
    row["in_contact"] = one.in_contact;
    row["left_out"] = leftOut(one);
    row["missing_frames"] = one.missing_frames;
    row["different"] = one.different;
    row["largest_difference_n"] = one.largest_difference_n;
    row["worst_tick"] = one.worst_tick;
    row["largest_law_difference_n"] = one.largest_law_difference_n;
  }
  return nlohmann::ordered_json{{"traces", list}}.dump(2) + "\n";
}

/// The run of which the traces are the cases.
DividedRun runOf(const std::vector<TraceFile>& traces) {
  nlohmann::json input = nlohmann::json::array();
  for (const TraceFile& trace : traces) input.push_back({trace.name, trace.bytes});
  return {.program = "haptic-replay", .version = HAPTICD_VERSION, .input = input, .cases = traces.size()};
}

struct Options {
  std::string trace;
  std::string config;
  std::vector<std::string> overrides;
  std::string depth;
  std::string hip;
  std::string fixtures;
  std::string out;
  base::IfExists if_exists = base::IfExists::refuse;  ///< of `out`
  Stage stage = Stage::law;
  double handle_delay_ms = 0;
  bool full_model = false;
  std::string traces;
  std::string out_folder;
  std::string json;
  Division division;
};

int fail(const std::vector<base::Error>& errors, int status) {
  for (const base::Error& error : errors) {
    std::fputs(fmt::format("haptic-replay: {}\n", error.text()).c_str(), stderr);
  }
  return status;
}

std::optional<base::Error> timeGoesBack(const std::vector<HipSample>& samples) {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i].time_s >= samples[i - 1].time_s) continue;
    return base::Error{fmt::format("sample {}", i + 1),
                       fmt::format("t_s {} is before that of the sample before, {}", samples[i].time_s,
                                   samples[i - 1].time_s),
                       "sort the file by time, or use --stage law"};
  }
  return std::nullopt;
}

/// The forces at positions.
struct Forces {
  std::string csv;
  bool any = false;  ///< whether one of them is not zero
};

base::Result<Forces> forcesOf(Replay& replay, const std::vector<HipSample>& samples) {
  Forces forces;
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,points,frame\n");
  for (const HipSample& sample : samples) {
    const auto felt = replay.feel(sample);
    if (!felt) return std::unexpected(felt.error());
    const rt::Vec3& p = sample.hip_m_in_world;
    const rt::Vec3& f = felt->force_n_in_world;
    fmt::format_to(std::back_inserter(text), "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{},{}\n",
                   sample.time_s, p.x, p.y, p.z, f.x, f.y, f.z, felt->points_used, felt->frame);
    forces.any = forces.any || f != rt::Vec3{};
  }
  forces.csv = fmt::to_string(text);
  return forces;
}

/// Adds the fixtures and regions of a file to those of the settings.
/// Errors: the file, also together with the settings.
std::vector<base::Error> addFrom(const std::string& file, config::SceneAdditions& additions) {
  constexpr std::size_t kMaxBytes = 1024 * 1024;
  const auto content = base::fileContent(file, {kMaxBytes, base::FileKind::any});
  if (!content) return {{file, content.error().text(), "name a file with fixtures: or regions:"}};
  const auto read = config::additionsFromText(*content, file);
  std::vector<config::AdditionError> problems;
  if (read) {
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(additions.fixtures, read->fixtures);
    append(additions.regions, read->regions);
    if (!read->label_image.empty()) additions.label_image = read->label_image;
    problems = config::checkTogether(additions);
  } else {
    problems = read.error();
  }
  std::vector<base::Error> errors;
  for (const config::AdditionError& problem : problems) errors.push_back(problem.error);
  return errors;
}

/// The solids of all fixtures, from where the daemon keeps them.
base::Result<config::SolidTable> solidsOf(const config::Settings& settings) {
  config::SolidTable solids;
  for (const config::FixtureSettings& fixture : settings.additions.fixtures) {
    if (fixture.kind != rt::FixtureKind::solid || solids.contains(fixture.solid)) continue;
    auto solid =
        config::loadSolid(std::filesystem::path(settings.state.folder) / config::kSolidFolder, fixture.solid);
    if (!solid) return std::unexpected(solid.error());
    solids[fixture.solid] = std::move(*solid);
  }
  return solids;
}

int replayFile(const Options& options) {
  auto settings = config::loadSettings(options.config, options.overrides);
  if (!settings) return fail(settings.error(), EX_CONFIG);
  if (!options.fixtures.empty()) {
    const auto errors = addFrom(options.fixtures, settings->additions);
    if (!errors.empty()) return fail(errors, EX_CONFIG);
  }
  const auto samples = readHipCsv(options.hip);
  if (!samples) return fail(samples.error(), EX_DATAERR);
  if (options.stage == Stage::command) {
    if (const auto error = timeGoesBack(*samples)) return fail({*error}, EX_DATAERR);
  }
  const auto source = DepthSource::open(options.depth, {settings->camera.near_m, settings->camera.far_m});
  if (!source) return fail({source.error()}, EX_NOINPUT);
  if (options.full_model) {
    settings->grid.extent = rt::ModelExtent::frame;
    if (const auto problem = wholeFrameProblem(*settings, *source)) return fail({*problem}, EX_CONFIG);
  }

  config::LabelImage labels;
  if (options.stage == Stage::command && !settings->additions.label_image.empty()) {
    auto loaded = config::loadLabelImage(settings->additions.label_image);
    if (!loaded) return fail({loaded.error()}, EX_CONFIG);
    labels = std::move(*loaded);
  }
  auto solids = solidsOf(*settings);
  if (!solids) return fail({solids.error()}, EX_CONFIG);
  Replay replay(*settings, *source, options.stage, options.handle_delay_ms * 1e-3, labels,
                std::move(*solids));
  const auto forces = forcesOf(replay, *samples);
  if (!forces) return fail({forces.error()}, EX_DATAERR);
  for (const std::string& problem : replay.depthProblems()) {
    std::fputs(fmt::format("haptic-replay: warning: {}: {}\n", options.depth, problem).c_str(), stderr);
  }
  if (!forces->any && !samples->empty()) {
    std::fputs(fmt::format("haptic-replay: warning: {}: no position touches the scene, all forces are zero\n",
                           options.hip)
                   .c_str(),
               stderr);
  }
  const auto written = base::writeWholeFile(options.out, forces->csv, options.if_exists);
  if (!written) return fail({written.error()}, EX_CANTCREAT);
  std::fputs(fmt::format("{}, {}\n", base::counted(samples->size(), "force(s)"),
                         base::counted(replay.models(), "scene(s) modelled"))
                 .c_str(),
             stdout);
  return EX_OK;
}

int replayTrace(const Options& options) {
  auto replay = TraceReplay::open(options.trace);
  if (!replay) return fail({replay.error()}, EX_NOINPUT);
  ForceTable table;
  TraceReplay::OnTick on_tick;
  if (!options.out.empty()) {
    on_tick = [&table](const rt::Tick& recorded, const rt::Tick& computed) { table.add(recorded, computed); };
  }
  const auto comparison = replay->run(on_tick);
  if (!comparison) return fail({comparison.error()}, EX_DATAERR);
  if (!options.out.empty()) {
    const auto written = base::writeWholeFile(options.out, table.text(), options.if_exists);
    if (!written) return fail({written.error()}, EX_CANTCREAT);
  }
  std::fputs(comparisonText(*comparison).c_str(), stdout);
  return comparison->different == 0 ? EX_OK : EXIT_FAILURE;
}

int report(const std::vector<TraceOutcome>& outcomes, const std::string& json_file) {
  std::fputs(outcomesText(outcomes).c_str(), stdout);
  if (!json_file.empty()) {
    const auto written = base::writeWholeFile(json_file, outcomesJson(outcomes), base::IfExists::replace);
    if (!written) return fail({written.error()}, EX_CANTCREAT);
  }
  const auto differs = [](const TraceOutcome& outcome) { return outcome.comparison.different > 0; };
  if (std::ranges::any_of(outcomes, differs)) return EXIT_FAILURE;
  const bool all = std::ranges::all_of(outcomes, &std::string::empty, &TraceOutcome::error);
  return all ? EX_OK : EX_DATAERR;
}

int replayFolder(const Options& options) {
  const auto traces = tracesIn(options.traces);
  if (!traces) return fail({traces.error()}, EX_NOINPUT);
  const Part part = options.division.part.value_or(Part{});
  std::vector<TraceOutcome> outcomes;
  for (std::size_t index = 0; index < traces->size(); ++index) {
    if (!part.has(index)) continue;
    outcomes.push_back(
        replayOne(std::filesystem::path(options.traces) / traces->at(index).name, options.out_folder));
  }
  if (!options.division.part) return report(outcomes, options.json);
  const PartFile file{.run = runOf(*traces), .part = part, .results = toFields(outcomes)};
  const auto written = base::writeWholeFile(options.json, partText(file), base::IfExists::replace);
  if (!written) return fail({written.error()}, EX_CANTCREAT);
  std::fputs(fmt::format("part {}: {} of {} traces\n", nameOf(part), outcomes.size(), traces->size()).c_str(),
             stdout);
  return EX_OK;
}

int joinFolder(const Options& options) {
  const auto whole = joinFiles(options.division.files, "haptic-replay", HAPTICD_VERSION);
  if (!whole) return fail({whole.error()}, EX_DATAERR);
  std::vector<TraceOutcome> outcomes;
  try {
    fromFields(whole->results, outcomes);
  } catch (const std::exception& problem) {
    return fail({{options.division.files.front(),
                  fmt::format("holds results that cannot be read: {}", problem.what()),
                  "compute the part again with --part"}},
                EX_DATAERR);
  }
  return report(outcomes, options.json);
}

int run(int argc, char** argv) {
  CLI::App app{
      "haptic-replay: the forces that hapticd's core computes for a recorded scene and given HIP positions.\n"
      "Times count from the first depth frame. A single image holds for all times. At the stage `command`\n"
      "the replay begins engaged, and each sample is one step of damping, passivity control and the safety\n"
      "chain; the velocity is estimated from the samples as the drivers do it.\n"
      "With --trace: computes the ticks of a trace again from the depth recorded in it, and compares. Ticks\n"
      "that depend on something that was not recorded are left out and counted. With --traces: the same for\n"
      "each trace of a folder, which several computers can share (--part, --join)."};
  app.footer(
      "Exit status: 0 done, 1 a force differs from the trace's, 64 usage, 65 bad HIP file, depth frame,\n"
      "trace or part, 66 no depth or trace, 73 no output, 78 configuration.");
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
  CLI::Option* const depth =
      app.add_option("--depth", options.depth, "folder of a recording, or one .pgm file")
          ->type_name("DIR_OR_PGM");
  CLI::Option* const hip =
      app.add_option("--hip", options.hip, "HIP positions in the world frame: t_s,x_m,y_m,z_m")
          ->type_name("CSV");
  app.add_flag_callback(
      "--force", [&options] { options.if_exists = base::IfExists::replace; },
      "replace the file of --out if it exists");
  app.add_option("--out", options.out, "where the forces go; needed without --trace")
      ->type_name("CSV")
      ->check(endsIn(".csv"));
  app.add_option(
         "--fixtures", options.fixtures,
         "virtual fixtures and tissue regions (YAML) besides those of the configuration, at the stage\n"
         "command")
      ->type_name("FILE")
      ->needs(hip);
  trace->excludes(config)->excludes(depth)->excludes(hip);
  CLI::Option* const traces =
      app.add_option("--traces", options.traces, "all finished traces of a folder, each as with --trace")
          ->type_name("FOLDER")
          ->excludes(trace)
          ->excludes(config)
          ->excludes(hip)
          ->excludes(depth)
          ->excludes("--out");
  app.add_option("--out-folder", options.out_folder, "with --traces: where NAME.csv of each trace goes")
      ->type_name("FOLDER")
      ->needs(traces)
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""));
  app.add_option("--json", options.json, "with --traces or --join: also write the result there, for programs")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  app.add_option("--stage", options.stage, "law (default) or command")
      ->type_name("STAGE")
      ->transform(CLI::CheckedTransformer(stages));
  app.add_option("--handle-delay-ms", options.handle_delay_ms,
                 "delay that the handle's driver would report, at the stage command (0)")
      ->type_name("MS")
      ->check(within(0.0, 1000.0));
  app.add_flag("--full-model", options.full_model, "model whole frames, not only the HIP's reach");
  addPartOptions(app, options.division, "--json");
  app.get_option("--part")->needs(traces);
  app.set_version_flag("-V,--version", std::string("haptic-replay ") + HAPTICD_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  if (!options.division.files.empty()) return joinFolder(options);
  if (!options.traces.empty()) return replayFolder(options);
  if (!options.json.empty())
    return fail({{"--json", "is only for --traces and --join", "--out writes the forces"}}, EX_USAGE);
  if (!options.out.empty()) {  // before the work, which may be long
    if (const auto may = base::mayWrite(options.out, options.if_exists); !may)
      return fail({may.error()}, EX_CANTCREAT);
  }
  if (!options.trace.empty()) return replayTrace(options);
  for (const auto& [name, given] : {std::pair{"--config", options.config},
                                    {"--depth", options.depth},
                                    {"--hip", options.hip},
                                    {"--out", options.out}}) {
    if (given.empty())
      return fail({{name, "is required without --trace", "see haptic-replay --help"}}, EX_USAGE);
  }
  if (!options.fixtures.empty() && options.stage == Stage::law) {
    return fail({{"--fixtures", "act after the law only", "add --stage command"}}, EX_USAGE);
  }
  return replayFile(options);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("haptic-replay", [&] { return hapticd::tools::run(argc, argv); });
}
