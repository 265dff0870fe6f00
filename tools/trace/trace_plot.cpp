#include "tools/trace/trace_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tools/hapticbench/gnuplot.h"
#include "tools/trace/peaks.h"
#include "tools/trace/selected_trace.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kUsualPoints = 2000;
constexpr double kShortest_s = 0.001;  // an axis of no length cannot be drawn

struct Point {
  double time_s = 0;
  double value = 0;
};

/// A quantity over time.
struct Curve {
  const char* label;
  double (*valueOf)(const rt::Tick& tick);
};

constexpr std::array<Curve, 3> kCurves{
    {{"force (N)", [](const rt::Tick& tick) { return norm(tick.command_force_n_in_world); }},
     {"penetration (mm)",
      [](const rt::Tick& tick) { return 1000 * norm(tick.proxy_m_in_world - tick.hip_m_in_world); }},
     {"wake-up latency (us)",
      [](const rt::Tick& tick) { return static_cast<double>(tick.wakeup_latency_ns) / 1000; }}}};

using Points = std::array<std::vector<Point>, kCurves.size()>;

config::Result<Points> pointsOf(const SelectedTrace& trace, std::size_t most, const Progress& progress) {
  const auto share = [&progress](double begin) {
    return progress ? Progress([&progress, begin](double done) { progress(begin + done / 2); }) : Progress();
  };
  const auto count = trace.countTicks(share(0));
  if (!count) return std::unexpected(count.error());
  Points points;
  std::vector<Peaks<Point>> peaks;
  for (std::vector<Point>& curve : points) {
    peaks.emplace_back(*count, most, [&curve](const Point& point) { curve.push_back(point); });
  }
  const auto add = [&](const rt::Tick& tick) {
    const double time_s = trace.seconds(tick.planned_ns);
    for (std::size_t i = 0; i < kCurves.size(); ++i) {
      const double value = kCurves[i].valueOf(tick);
      peaks[i].add(value, {time_s, value});
    }
    return true;
  };
  if (auto read = trace.readAll({.tick = add}, share(0.5)); !read) return std::unexpected(read.error());
  for (Peaks<Point>& curve : peaks) curve.finish();
  return points;
}

/// Infinity and NaN are drawn as gaps.
void addPoints(std::string& script, std::size_t curve, const std::vector<Point>& points) {
  const auto to = std::back_inserter(script);
  fmt::format_to(to, "$curve{} << END\n", curve);
  for (const Point& point : points) {
    if (std::isfinite(point.value)) {
      fmt::format_to(to, "{} {}\n", point.time_s, point.value);
    } else {
      script += '\n';
    }
  }
  script += "END\n";
}

/// Of the axis of a curve: gnuplot's own choice, but a curve of one value only has a height too.
std::string rangeOf(const std::vector<Point>& points) {
  double least = std::numeric_limits<double>::infinity(), largest = -least;
  for (const Point& point : points) {
    if (!std::isfinite(point.value)) continue;
    least = std::min(least, point.value);
    largest = std::max(largest, point.value);
  }
  return least < largest || largest < least ? "set autoscale y"
                                            : fmt::format("set yrange [{}:{}]", least, least + 1);
}

std::string scriptOf(const Points& points, const std::string& title, const std::string& terminal,
                     const std::filesystem::path& image) {
  std::string script;
  for (std::size_t i = 0; i < points.size(); ++i) addPoints(script, i, points[i]);
  const auto to = std::back_inserter(script);
  fmt::format_to(to,
                 "set terminal {} size 1200,900\nset output '{}'\n"
                 "set multiplot layout {},1 title '{}' noenhanced\n"
                 "set grid\nset lmargin 12\nunset key\nset xrange [{}:{}]\n",
                 terminal, gnuplotQuoted(image.string()), points.size(), gnuplotQuoted(title),
                 points[0].front().time_s,
                 std::max(points[0].back().time_s, points[0].front().time_s + kShortest_s));
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i + 1 == points.size()) script += "set xlabel 'time (s)'\n";
    fmt::format_to(to, "{}\nset ylabel '{}'\nplot $curve{} with lines lc rgb '#303090'\n", rangeOf(points[i]),
                   kCurves[i].label, i);
  }
  script += "unset multiplot\n";
  return script;
}

config::Result<std::string> terminalFor(const std::filesystem::path& image) {
  if (image.extension() == ".png") return "pngcairo background rgb 'white'";
  if (image.extension() == ".svg") return "svg background rgb 'white'";
  return std::unexpected(
      config::Error{image.string(), "is neither a PNG nor an SVG", "end its name in .png or .svg"});
}

}  // namespace

config::Result<void> plotTrace(const std::filesystem::path& trace_file, const std::filesystem::path& image,
                               const TraceSelection& selection, const Progress& progress,
                               IfExists if_exists) {
  const auto terminal = terminalFor(image);
  if (!terminal) return std::unexpected(terminal.error());
  const auto trace = SelectedTrace::open(trace_file, selection);
  if (!trace) return std::unexpected(trace.error());
  auto file = WholeFile::create(image, if_exists);
  if (!file) return std::unexpected(file.error());
  const auto points =
      pointsOf(*trace, selection.most_ticks == 0 ? kUsualPoints : selection.most_ticks, progress);
  if (!points) return std::unexpected(points.error());
  if (points->front().empty()) {
    return std::unexpected(
        config::Error{trace_file.string(), "has no ticks in that time", "choose another stretch"});
  }
  const std::string script = scriptOf(*points, trace_file.filename().string(), *terminal, file->draft());
  if (auto drawn = runGnuplot(script, file->draft(), "The Debian package is gnuplot-nox."); !drawn)
    return drawn;
  return file->finish();
}

}  // namespace hapticd::tools
