// SPDX-License-Identifier: Apache-2.0
#include "tools/trace/trace_plot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "config/value_text.h"
#include "tools/gnuplot/gnuplot.h"
#include "tools/trace/columns.h"
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

/// A quantity over time, of fields that an older trace may lack and that not every law has.
struct Quantity {
  const char* name;
  const char* unit;
  double (*valueOf)(const rt::Tick& tick);
  std::array<std::string_view, 2> fields;
};

constexpr std::array<Quantity, 3> kQuantities{
    {{"force",
      "N",
      [](const rt::Tick& tick) { return norm(tick.command_force_n_in_world); },
      {"command_force_n_in_world"}},
     {"penetration",
      "mm",
      [](const rt::Tick& tick) { return 1000 * norm(tick.proxy_m_in_world - tick.hip_m_in_world); },
      {"proxy_m_in_world", "hip_m_in_world"}},
     {"wake-up latency",
      "us",
      [](const rt::Tick& tick) { return static_cast<double>(tick.wakeup_latency_ns) / 1000; },
      {"wakeup_latency_ns"}}}};

struct Curve {
  const Quantity* quantity;
  std::vector<Point> points;
};

struct Curves {
  std::vector<Curve> known;
  std::vector<std::string_view> lacking;  ///< names of those that the trace's version did not record
  std::vector<std::string_view> foreign;  ///< names of those that the laws in use do not have
};

/// NaN where the law in use does not have it.
double valueAt(const Quantity& quantity, const SelectedTrace& trace, const rt::Tick& tick) {
  const bool says =
      std::ranges::all_of(quantity.fields, [&](std::string_view field) { return trace.says(tick, field); });
  return says ? quantity.valueOf(tick) : std::numeric_limits<double>::quiet_NaN();
}

/// Sets aside what no tick says anything of.
void takeOutForeign(Curves& curves) {
  std::erase_if(curves.known, [&curves](const Curve& curve) {
    const bool foreign =
        std::ranges::any_of(curve.quantity->fields, needsProxy) &&
        std::ranges::all_of(curve.points, [](const Point& p) { return std::isnan(p.value); });
    if (foreign) curves.foreign.emplace_back(curve.quantity->name);
    return foreign;
  });
}

Curves curvesOf(const SelectedTrace& trace) {
  Curves curves;
  for (const Quantity& quantity : kQuantities) {
    const bool lacks = std::ranges::any_of(
        quantity.fields, [&trace](std::string_view field) { return trace.lacks<rt::Tick>(field); });
    if (lacks) {
      curves.lacking.emplace_back(quantity.name);
    } else {
      curves.known.push_back({&quantity, {}});
    }
  }
  return curves;
}

config::Result<void> fill(std::vector<Curve>& curves, const SelectedTrace& trace, std::size_t most,
                          const Progress& progress) {
  const auto share = [&progress](double begin) {
    return progress ? Progress([&progress, begin](double done) { progress(begin + done / 2); }) : Progress();
  };
  const auto count = trace.countTicks(share(0));
  if (!count) return std::unexpected(count.error());
  std::vector<Peaks<Point>> peaks;
  for (Curve& curve : curves) {
    peaks.emplace_back(*count, most, [&curve](const Point& point) { curve.points.push_back(point); });
  }
  const auto add = [&](const rt::Tick& tick) {
    const double time_s = trace.seconds(tick.planned_ns);
    for (std::size_t i = 0; i < curves.size(); ++i) {
      const double value = valueAt(*curves[i].quantity, trace, tick);
      peaks[i].add(value, {time_s, value});
    }
    return true;
  };
  if (auto read = trace.readAll({.tick = add}, share(0.5)); !read) return std::unexpected(read.error());
  for (Peaks<Point>& curve : peaks) curve.finish();
  return {};
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

std::string scriptOf(const std::vector<Curve>& curves, const std::string& title, const char* terminal) {
  std::string script;
  for (std::size_t i = 0; i < curves.size(); ++i) addPoints(script, i, curves[i].points);
  const auto to = std::back_inserter(script);
  const double first_s = curves.front().points.front().time_s, last_s = curves.front().points.back().time_s;
  fmt::format_to(to,
                 "set terminal {} size 1200,900 background rgb 'white'\n"
                 "set multiplot layout {},1 title '{}' noenhanced\n"
                 "set grid\nset lmargin 12\nunset key\nset xrange [{}:{}]\n",
                 terminal, curves.size(), gnuplotQuoted(title), first_s,
                 std::max(last_s, first_s + kShortest_s));
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (i + 1 == curves.size()) script += "set xlabel 'time (s)'\n";
    fmt::format_to(to, "{}\nset ylabel '{} ({})'\nplot $curve{} with lines lc rgb '#303090'\n",
                   rangeOf(curves[i].points), curves[i].quantity->name, curves[i].quantity->unit, i);
  }
  script += "unset multiplot\n";
  return script;
}

std::string titleOf(const std::filesystem::path& trace, const Curves& curves) {
  std::string title = config::printable(trace.filename().string());
  if (!curves.lacking.empty())
    title += fmt::format(", of another version: no {}", fmt::join(curves.lacking, ", "));
  if (!curves.foreign.empty())
    title += fmt::format(", of a law without a proxy: no {}", fmt::join(curves.foreign, ", "));
  return title;
}

config::Error nothingToDraw(const std::filesystem::path& trace) {
  return {trace.string(), "has nothing of what is drawn", "export it instead: hapticctl trace export"};
}

constexpr std::array<std::string_view, 2> kEndings{".png", ".svg"};

}  // namespace

config::Result<void> plotTrace(const std::filesystem::path& trace_file, const std::filesystem::path& image,
                               const TraceSelection& selection, const Progress& progress,
                               IfExists if_exists) {
  if (auto known = checkEnding(image, kEndings); !known) return known;
  const auto trace = SelectedTrace::open(trace_file, selection);
  if (!trace) return std::unexpected(trace.error());
  if (auto ticks = trace->requireTicks(); !ticks) return ticks;
  auto file = WholeFile::create(image, if_exists);
  if (!file) return std::unexpected(file.error());
  Curves curves = curvesOf(*trace);
  if (curves.known.empty()) return std::unexpected(nothingToDraw(trace_file));
  const std::size_t most = selection.most_ticks == 0 ? kUsualPoints : selection.most_ticks;
  if (auto filled = fill(curves.known, *trace, most, progress); !filled) return filled;
  if (curves.known.front().points.empty()) {
    return std::unexpected(
        config::Error{trace_file.string(), "has no ticks in that time", "choose another stretch"});
  }
  takeOutForeign(curves);
  if (curves.known.empty()) return std::unexpected(nothingToDraw(trace_file));
  const std::string script = scriptOf(curves.known, titleOf(trace_file, curves), gnuplotTerminal(image));
  const auto drawn = drawnByGnuplot(script, "The Debian package is gnuplot-nox.");
  if (!drawn) return std::unexpected(drawn.error());
  if (auto written = file->append(*drawn); !written) return written;
  return file->finish();
}

}  // namespace hapticd::tools
