// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/pareto_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "tools/lib/gnuplot/gnuplot.h"

namespace hapticd::tools {
namespace {

/// Points that share a mark, which their law has, and a colour.
struct Series {
  std::string title;
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

/// Returns the text that distinguishes a point from the others of its series.
std::string labelOf(const ContenderKind& kind) {
  return kind.is_ours ? "" : kind.name;
}

std::vector<Series> allSeries(const ParetoResult& result) {
  std::vector<Series> all;
  for (const ParetoPoint& point : result.points) {
    const Series its = seriesOf(point.run.kind);
    auto series = std::ranges::find(all, its.title, &Series::title);
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
  add(fmt::format("set terminal {} size 900,640 background rgb 'white'\n", gnuplotTerminal(image)));
  add("set logscale xy\nset grid\nset offsets graph 0.03, graph 0.15, graph 0.08, graph 0.03\n"
      "set xlabel 'CPU time, ms per second of use (30 frames modelled, 1000 forces)'\n"
      "set ylabel 'RMS force error, multiples of the just noticeable difference'\n"
      "set key outside bottom center horizontal maxrows 4\n");
  for (std::size_t i = 0; i < all.size(); ++i) add(fmt::format("$s{} << END\n{}END\n", i, all[i].block));
  for (std::size_t i = 0; i < all.size(); ++i) {
    add(
        fmt::format("{} $s{} using 1:2 with points pt {} ps 1 lc rgb '{}' title '{}' noenhanced, "
                    "$s{} using 1:2:3 with labels left rotate by 30 offset 0.6,0.4 font ',9' tc rgb '{}' "
                    "noenhanced notitle",
                    i == 0 ? "plot" : ", \\\n ", i, all[i].mark, all[i].colour, gnuplotQuoted(all[i].title),
                    i, all[i].colour));
  }
  add("\n");
  return fmt::to_string(script);
}

config::Result<void> plotPareto(const ParetoResult& result, const std::filesystem::path& image) {
  return runGnuplot(plotScript(result, image), image, "--json writes the data");
}

}  // namespace hapticd::tools
