// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "tools/gnuplot/gnuplot.h"

namespace hapticd::tools {
namespace {

std::vector<std::string> wallsIn(const std::vector<RegionPoint>& points) {
  std::vector<std::string> walls;
  for (const RegionPoint& point : points) {
    if (walls.empty() || walls.back() != point.wall) walls.push_back(point.wall);
  }
  return walls;
}

template <typename Chosen>
void addBlock(fmt::memory_buffer& script, std::string_view name, const std::vector<RegionPoint>& points,
              Chosen chosen) {
  fmt::format_to(std::back_inserter(script), "${} << END\n", name);
  for (const RegionPoint& point : points) chosen(script, point);
  fmt::format_to(std::back_inserter(script), "END\n");
}

/// One panel; B is shifted by 0.1 so that B = 0 has a place on the logarithmic axis.
void addPanel(fmt::memory_buffer& script, const std::string& wall, const std::vector<RegionPoint>& points) {
  const auto addPoints = [&wall](bool stable) {
    return [&wall, stable](fmt::memory_buffer& to, const RegionPoint& point) {
      if (point.wall != wall || point.stable != stable) return;
      fmt::format_to(std::back_inserter(to), "{} {}\n", point.damping_n_s_per_m + 0.1,
                     point.stiffness_n_per_m);
    };
  };
  const auto addLimit = [&wall](double RegionPoint::*limit) {
    return [&wall, limit, last = -1.0](fmt::memory_buffer& to, const RegionPoint& point) mutable {
      if (point.wall != wall || point.damping_n_s_per_m == last) return;
      last = point.damping_n_s_per_m;
      if (point.*limit > 0) fmt::format_to(std::back_inserter(to), "{} {}\n", last + 0.1, point.*limit);
    };
  };
  addBlock(script, "stable", points, addPoints(true));
  addBlock(script, "unstable", points, addPoints(false));
  addBlock(script, "rule", points, addLimit(&RegionPoint::rule_n_per_m));
  addBlock(script, "eigenvalue", points, addLimit(&RegionPoint::eigenvalue_n_per_m));
  fmt::format_to(
      std::back_inserter(script),
      "set title '{}' noenhanced\n"
      "plot $stable with points pt 7 ps 0.6 lc rgb '#2a7f3f' title 'stable', "
      "$unstable with points pt 2 ps 0.6 lc rgb '#c03030' title 'unstable', "
      "$rule with linespoints pt 1 ps 0.7 lw 2 lc rgb '#808080' title '(b+B)/(T/2+t_d)' noenhanced, "
      "$eigenvalue with linespoints pt 1 ps 0.7 lw 2 dt 2 lc rgb '#303090' title 'eigenvalues'\n",
      wall);
}

std::string scriptOf(const std::vector<RegionPoint>& points, const std::string& title) {
  const std::vector<std::string> walls = wallsIn(points);
  const auto [lowest, highest] = std::minmax_element(
      points.begin(), points.end(),
      [](const RegionPoint& a, const RegionPoint& b) { return a.stiffness_n_per_m < b.stiffness_n_per_m; });
  fmt::memory_buffer script;
  fmt::format_to(
      std::back_inserter(script),
      "set terminal svg size {},480 background rgb 'white'\n"
      "set multiplot layout 1,{} title '{}' noenhanced\nset logscale xy\n"
      "set xlabel 'B + 0.1 (N s/m)'\nset ylabel 'K (N/m)'\nset xrange [0.08:50]\nset yrange [{}:{}]\n"
      "set bmargin 9\nset key at screen 0.5, 0.16 center\n",
      360 * walls.size(), walls.size(), gnuplotQuoted(title), lowest->stiffness_n_per_m / 1.2,
      highest->stiffness_n_per_m * 1.2);
  for (const std::string& wall : walls) {
    addPanel(script, wall, points);
    fmt::format_to(std::back_inserter(script), "unset key\n");  // the first panel's is for all
  }
  fmt::format_to(std::back_inserter(script), "unset multiplot\n");
  return fmt::to_string(script);
}

}  // namespace

std::string regionTsv(const std::vector<RegionPoint>& points) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "law\tstiffness_n_per_m\tdamping_n_s_per_m\tstable\trule_n_per_m\teigenvalue_n_per_m\n");
  for (const RegionPoint& point : points) {
    fmt::format_to(std::back_inserter(text), "{}\t{:.6g}\t{:.6g}\t{}\t{:.6g}\t{:.6g}\n", point.wall,
                   point.stiffness_n_per_m, point.damping_n_s_per_m, point.stable ? 1 : 0, point.rule_n_per_m,
                   point.eigenvalue_n_per_m);
  }
  return fmt::to_string(text);
}

config::Result<void> plotRegion(const std::vector<RegionPoint>& points, const std::string& title,
                                const std::filesystem::path& svg_file) {
  return runGnuplot(scriptOf(points, title), svg_file, "--region writes the data");
}

}  // namespace hapticd::tools
