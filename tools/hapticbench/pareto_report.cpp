// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>

#include "rt/base/realtime_thread.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/pareto.h"
#include "tools/lib/plot/gnuplot.h"

namespace hapticd::tools {
namespace {

Row pointCells(const ParetoPoint& p) {
  return {{"/name", "", 0, p.run.kind.name},
          {"/library", "", 0, !p.run.kind.is_ours},
          {"/force_us/median", "", 0, p.cost.force_median_us},
          {"/force_us/mean", "", 0, p.cost.force_mean_us},
          {"/force_us/p99_9", "", 0, p.cost.force_p999_us},
          {"/force_us/max", "", 0, p.cost.force_max_us},
          {"/model_us/median", "", 0, p.cost.model_median_us},
          {"/model_us/mean", "", 0, p.cost.model_mean_us},
          {"/model_us/max", "", 0, p.cost.model_max_us},
          {"/cpu_ms_per_s", "", 0, p.cost.cpu_ms_per_s()},
          {"/rms_error_jnd", "", 0, p.error.error_jnd.rms()},
          {"/rms_error_mm", "", 0, p.error_mm()}};
}

Row evaluationCells(const EvaluationRow& r) {
  return {{"/scene", "one force, medians", 0, r.scene},
          {"/along_path", "along a path", 0, r.along_path},
          {"/nanoflann_us", "nanoflann us", 2, r.nanoflann_us},
          {"/nearest_springs_us", "nearest_springs us", 3, r.nearest_springs_us},
          {"", "times", 1, r.nanoflann_us / r.nearest_springs_us},
          {"/surface_us", "surface us", 3, r.surface_us},
          {"", "times", 1, r.nanoflann_us / r.surface_us}};
}

Row hardFrameCells(const HardFrameRow& r) {
  return {{"/frame", "hard frame", 0, r.frame},
          {"/law", "law", 0, r.law},
          {"/force_max_us", "force max us", 1, r.force_max_us},
          {"", "% of tick", 2, r.force_max_us / 10},
          {"/model_max_us", "model max us", 0, r.model_max_us}};
}

/// The different values of a member, in the order in which they come.
template <typename Item, typename Value>
std::vector<Value> differentOf(const std::vector<Item>& items, Value Item::*member) {
  std::vector<Value> values;
  for (const Item& item : items) {
    if (std::ranges::find(values, item.*member) == values.end()) values.push_back(item.*member);
  }
  return values;
}

/// The name of a noise model in the tables.
const char* cameraOf(SceneNoise noise) {
  return noise == SceneNoise::harsh ? "harsher" : "quieter";
}

/// Two significant digits: the repeatability of the measurement allows no more.
std::string twoDigits(double value) {
  if (!std::isfinite(value)) return "-";
  if (value < 0.005) return "0";
  return value < 10 ? fmt::format("{:#.2g}", value) : fmt::format("{:.0f}", value);
}

/// Returns `first` and a heading for each distance.
std::vector<std::string> headingsOf(std::vector<std::string> first, const std::vector<double>& distances_m) {
  for (const double distance_m : distances_m) first.push_back(fmt::format("{:g} m", distance_m));
  return first;
}

/// The figures of one law, noise and distance for each kind of surface: "0.2 / 0.4 / 0.3".
template <typename Figure>
std::string cellOf(const ParetoResult& result, const std::string& law, SceneNoise noise, double distance_m,
                   Figure figure) {
  std::string cell;
  for (const DistanceError& row : result.distance_errors) {
    if (row.law != law || row.noise != noise || row.distance_m != distance_m) continue;
    cell += (cell.empty() ? "" : " / ") + figure(row);
  }
  return cell;
}

/// A row for each law and noise. `figure` makes a text of a DistanceError.
template <typename Figure>
std::string errorsTable(const ParetoResult& result, const std::string& heading, bool with_springs,
                        Figure figure) {
  const std::vector<double> distances_m = differentOf(result.distance_errors, &DistanceError::distance_m);
  std::vector<std::vector<std::string>> rows;
  for (const std::string& law : differentOf(result.distance_errors, &DistanceError::law)) {
    if (!with_springs && law.ends_with("springs")) continue;
    for (const SceneNoise noise : differentOf(result.distance_errors, &DistanceError::noise)) {
      auto& cells = rows.emplace_back(std::vector<std::string>{"`" + law + "`", cameraOf(noise)});
      for (const double distance_m : distances_m)
        cells.push_back(cellOf(result, law, noise, distance_m, figure));
    }
  }
  return markdownTable(headingsOf({heading, "camera"}, distances_m), 2, rows) + "\n";
}

std::string errorsMarkdown(const ParetoResult& result) {
  const auto& errors = result.distance_errors;
  if (errors.empty()) return "";
  std::string text =
      "RMS error of the force in JND on strokes 8 mm deep (4 N; 1 JND = 0.28 N is just noticed), on flat / "
      "curved / moving surfaces: planes to 30 degrees, a ball of 100 mm and a rod of 80 mm, a plane at "
      "0.3 m/s.\n\n" +
      errorsTable(result, "law", true, [](const DistanceError& row) { return twoDigits(row.rms_jnd); });
  if (std::ranges::all_of(errors, [](const DistanceError& row) { return row.law.ends_with("springs"); }))
    return text;
  text +=
      "The same over the least that the sensor's noise allows with 160 mm of a flat surface, or on a ball or "
      "rod "
      "of which only that is known (8 frames, 3 where it moves):\n\n" +
      errorsTable(result, "times the floor", false,
                  [](const DistanceError& row) { return row.by_floor ? twoDigits(*row.by_floor) : "-"; });
  return text + "Contact lost, % of the stroke:\n\n" +
         errorsTable(result, "contact lost", false,
                     [](const DistanceError& row) { return twoDigits(row.lost_percent); });
}

/// The range over the noise models, "0.14 to 0.16"; "-" where nothing was measured.
std::string rangeOf(const ParetoResult& result, SurfaceKind kind, double distance_m) {
  std::vector<double> errors_jnd;
  for (const DistanceError& row : result.distance_errors) {
    if (row.law == "surface" && row.kind == kind && row.distance_m == distance_m)
      errors_jnd.push_back(row.rms_jnd);
  }
  if (errors_jnd.empty()) return "-";
  const auto [smallest, largest] = std::ranges::minmax(errors_jnd);
  const std::string from = twoDigits(smallest), to = twoDigits(largest);
  return from == to ? from : fmt::format("{} to {}", from, to);
}

std::string sensorMarkdown(const ParetoResult& result) {
  if (result.sensor_limits.empty()) return "";
  const std::vector<SceneNoise> noises = differentOf(result.sensor_limits, &SensorLimit::noise);
  const std::vector<double> distances_m = differentOf(result.sensor_limits, &SensorLimit::distance_m);
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const char* what, const char* camera, SceneNoise noise, double SensorLimit::*figure) {
    auto& cells = rows.emplace_back(std::vector<std::string>{what, camera});
    for (const SensorLimit& limit : result.sensor_limits) {
      if (limit.noise == noise) cells.push_back(twoDigits(limit.*figure));
    }
  };
  add("one step of depth, mm", "all", noises.front(), &SensorLimit::raw_unit_mm);
  add("narrowest body, mm", "all", noises.front(), &SensorLimit::narrowest_mm);
  for (const SceneNoise noise : noises) {
    add("flat, 40 mm", cameraOf(noise), noise, &SensorLimit::flat_40_mm_jnd);
    add("flat, 160 mm", cameraOf(noise), noise, &SensorLimit::flat_160_mm_jnd);
    add("ball, 100 mm", cameraOf(noise), noise, &SensorLimit::ball_100_mm_jnd);
  }
  return "What no law can do better, because of the sensor: the step of its depth, bodies of fewer than "
         "eight pixels, and the least error (JND) on a patch of that side or a ball, still, 8 frames.\n\n" +
         markdownTable(headingsOf({"the sensor", "camera"}, distances_m), 2, rows) + "\n";
}

std::string costsMarkdown(const ParetoResult& result) {
  std::vector<double> distances_m = differentOf(result.laws, &LawAtDistance::distance_m);
  std::erase_if(distances_m, [](double distance_m) {
    return std::ranges::find(kCostDistances_m, distance_m) == std::end(kCostDistances_m);
  });
  if (distances_m.empty()) return "";
  std::vector<std::vector<std::string>> rows;
  for (const LawSetting& setting : shippedSettings()) {
    auto& cells = rows.emplace_back(std::vector<std::string>{nameOf(setting)});
    for (const LawAtDistance& row : result.laws) {
      if (row.setting != setting || std::ranges::find(distances_m, row.distance_m) == distances_m.end())
        continue;
      cells.push_back(fmt::format("{:.0f} / {:.2f} / {:.2f}", row.cost.model_median_us,
                                  row.cost.force_median_us, row.cost.cpu_ms_per_s()));
    }
  }
  return "Cost on a plane turned by 30 degrees: median of a frame (us) / median of a force (us) / CPU (ms "
         "per s of use: 30 frames, 1000 forces).\n\n" +
         markdownTable(headingsOf({"law and setting"}, distances_m), 1, rows) + "\n";
}

std::string pointsMarkdown(const ParetoResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const ParetoPoint& point : result.points) {
    const CpuCost& cost = point.cost;
    rows.push_back({point.run.kind.name, fmt::format("{:.2f}", cost.force_p999_us),
                    fmt::format("{:.0f}", cost.model_median_us), fmt::format("{:.2f}", cost.cpu_ms_per_s()),
                    fmt::format("{:.2f}", point.error.error_jnd.rms()),
                    fmt::format("{:.2f}", point.error_mm())});
  }
  return "Beside libraries that compute the paper's law, on the recordings and a synthetic table; errors at "
         "1 m with the harsher camera, 5 to 20 mm deep.\n\n" +
         markdownTable({"law and setting", "force, p99.9 (us)", "model of a frame (us)",
                        "CPU (ms per s of use)", "RMS error (JND)", "(mm)"},
                       1, rows);
}

std::string figuresMarkdown(const ParetoResult& result) {
  return errorsMarkdown(result) + sensorMarkdown(result) + costsMarkdown(result) + pointsMarkdown(result);
}

std::string requirementsMarkdown(const ParetoResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const Requirement& requirement : requirementsOf(result)) {
    rows.push_back(
        {requirement.text,
         fmt::format("{:.3g}{}", requirement.measured, requirement.met() ? "" : " (not met)"),
         fmt::format("{} {:g}", requirement.at_least ? "at least" : "at most", requirement.limit)});
  }
  return "\n" + markdownTable({"requirement", "measured", "limit"}, 1, rows);
}

}  // namespace

std::string paretoMarkdown(const ParetoResult& result) {
  return figuresMarkdown(result) + requirementsMarkdown(result);
}

Report paretoReport(const ParetoResult& result, int cpu) {
  Report report;
  report.say(fmt::format(
      "CPU time on one core{}, HIP at up to 0.5 m/s that touches and leaves the surface, on {}. Times:\n"
      "the fastest of several runs, sample by sample, less the cost of the clock.\n\n",
      cpu < 0 ? ", not pinned" : fmt::format(", CPU {}", cpu), fmt::join(result.scenes, ", ")));
  report.say(figuresMarkdown(result));
  report.note("/cpu", cpu);
  for (std::size_t i = 0; i < result.scenes.size(); ++i)
    report.note(fmt::format("/scenes/{}", i), result.scenes[i]);
  report.note("/points", rowsOf(result.points, pointCells));
  report.table("evaluations", "\n", rowsOf(result.evaluations, evaluationCells));
  report.table("hard_frames", "\n", rowsOf(result.hard_frames, hardFrameCells));
  report.requirements(requirementsOf(result));
  return report;
}

std::string surfaceErrorMarkdown(const ParetoResult& result) {
  const std::vector<double> distances_m = differentOf(result.distance_errors, &DistanceError::distance_m);
  std::vector<std::vector<std::string>> rows;
  for (const SurfaceKind kind : kAllOf<SurfaceKind>) {
    auto& cells = rows.emplace_back(std::vector<std::string>{fmt::format("{} surface", nameOf(kind))});
    for (const double distance_m : distances_m) cells.push_back(rangeOf(result, kind, distance_m));
  }
  return markdownTable(headingsOf({"RMS error of `surface`, JND"}, distances_m), 1, rows);
}

namespace {

/// Points that share a mark, which their law has, and a colour.
struct Series {
  std::string name;
  int mark;
  std::string colour;
  std::string block;
};

Series seriesOf(const ContenderKind& kind) {
  constexpr int kFirstMark = 4;
  if (!kind.is_ours) return {"libraries, the paper's law", kFirstMark + 4, "#606060", ""};
  const LawSetting& setting = kind.setting;
  const bool usual_frames = setting.fusion_frames == LawSetting{}.fusion_frames;
  const char* colour = setting.filtered ? "#2a7f3f" : usual_frames ? "#303090" : "#d07010";
  return {nameOf(setting), kFirstMark + static_cast<int>(setting.law), colour, ""};
}

std::string labelOf(const ContenderKind& kind) {
  return kind.is_ours ? nameOf(kind.setting) : kind.name;
}

std::vector<Series> allSeries(const ParetoResult& result) {
  std::vector<Series> all;
  for (const ParetoPoint& point : result.points) {
    const Series its = seriesOf(point.run.kind);
    auto series = std::ranges::find(all, its.name, &Series::name);
    if (series == all.end()) series = all.insert(all.end(), its);
    series->block += fmt::format("{:.6g} {:.6g} \"{}\"\n", point.cost.cpu_ms_per_s(),
                                 point.error.error_jnd.rms(), labelOf(point.run.kind));
  }
  return all;
}

}  // namespace

std::string plotScript(const ParetoResult& result, const std::filesystem::path& image) {
  const std::vector<Series> all = allSeries(result);
  fmt::memory_buffer script;
  const auto add = [&script](const std::string& text) {
    fmt::format_to(std::back_inserter(script), "{}", text);
  };
  const std::string terminal = gnuplotTerminal(image);
  add(fmt::format("set terminal {} size {} background rgb 'white'\n", terminal,
                  terminal == "pdfcairo" ? "17cm,12cm" : "900,640"));
  add("set logscale xy\nset grid\nset offsets graph 0.03, graph 0.15, graph 0.08, graph 0.03\nunset key\n"
      "set title \"Force laws: CPU time and error\\n{/*0.8 grey: libraries that compute the law of the "
      "paper}\"\n"
      "set xlabel 'CPU time, ms per second of use (30 frames modelled, 1000 forces)'\n"
      "set ylabel 'RMS force error, multiples of the just noticeable difference (JND)'\n"
      "set arrow from graph 0, first 1 to graph 1, first 1 nohead dashtype 2 lc rgb '#b02020'\n"
      "set label '1 JND: smaller errors are not noticed' at graph 0.99, first 1 right offset 0,0.5 font "
      "',9'\n");
  for (std::size_t i = 0; i < all.size(); ++i) add(fmt::format("$s{} << END\n{}END\n", i, all[i].block));
  for (std::size_t i = 0; i < all.size(); ++i) {
    add(
        fmt::format("{} $s{} using 1:2 with points pt {} ps 1 lc rgb '{}', "
                    "$s{} using 1:2:3 with labels left rotate by 30 offset 0.6,0.4 font ',9' tc rgb '{}' "
                    "noenhanced",
                    i == 0 ? "plot" : ", \\\n ", i, all[i].mark, all[i].colour, i, all[i].colour));
  }
  add("\n");
  return fmt::to_string(script);
}

namespace {

/// What is measured, and where it goes.
struct ParetoFiles {
  ParetoOptions options;
  std::string markdown_file, surface_table_file, laws_table_file;
  int cpu = -1;
};

void useQuickOptions(ParetoOptions& options) {
  options.settings = {{},
                      {.law = rt::ForceLaw::smooth_springs},
                      {.law = rt::ForceLaw::proxy},
                      {.law = rt::ForceLaw::surface}};
  options.cost = {.seconds = 0.2, .repeats = 1, .checks = 3};
  options.laws = {.distances_m = {1}, .seconds = 0.1, .repeats = 1, .pushes = 1};
  options.distances = {.laws = {"nearest_springs", "surface"},
                       .distances_m = {1},
                       .noises = {SceneNoise::harsh},
                       .kinds = {SurfaceKind::flat},
                       .variants = 1};
  options.evaluations = 100;
  options.pushes = 1;
  options.hard_frames = false;
}

int runPareto(const ParetoFiles& chosen, const StudyCommand& command) {
  const int cpu = rt::pinToCpu(chosen.cpu);
  const auto result = measurePareto(chosen.options);
  if (!result) return fail(result.error(), EX_NOINPUT);
  Report report = paretoReport(*result, cpu);
  report.drawAs([&result](const std::filesystem::path& image) { return plotScript(*result, image); });
  int status = command.report(report);
  const auto write = [&status](const std::string& file, const std::string& text) {
    if (status == EX_OK) status = writeReport(file, text);
  };
  write(chosen.markdown_file, paretoMarkdown(*result));
  write(chosen.surface_table_file, surfaceErrorMarkdown(*result));
  write(chosen.laws_table_file, lawsTable(result->laws, "tools/figures"));
  return status;
}

}  // namespace

StudyCommand paretoCommand(CLI::App& app) {
  const auto chosen = std::make_shared<ParetoFiles>();
  StudyCommand command(app, "pareto", "CPU time against force error, every law and setting as one point");
  command.quick("short motions, one run, the default settings only",
                [chosen] { useQuickOptions(chosen->options); });
  command.number("--cpu", chosen->cpu, -1, 1023, "CPU to run on (the last one)");
  command.recordings(chosen->options.recordings);
  command.file("--markdown", chosen->markdown_file, ".md", "write all tables there as Markdown");
  command.file("--surface-table", chosen->surface_table_file, ".md",
               "write the error of the law surface by distance there, one table as Markdown");
  command.file("--laws-table", chosen->laws_table_file, ".inc",
               "write the table that `auto` chooses by (config/settings/measured_laws.inc)");
  command.onRun([chosen](const StudyCommand& self) { return runPareto(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
