// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/plot/trace_plot.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/value_text.h"
#include "daemon/trace/export/selected_trace.h"
#include "daemon/trace/export/trace_summary.h"
#include "rt/base/words.h"
#include "tools/lib/plot/gnuplot.h"

namespace hapticd::tools {
namespace {

constexpr std::size_t kUsualPoints = 2000;
constexpr double kMin_s = 0.001;  // an axis of no length cannot be drawn
constexpr double kMinDrawn = 1e-9;
/// With more lines a picture cannot be read.
constexpr std::size_t kMaxEventLines = 300;
constexpr std::size_t kMaxSpans = 1000;
constexpr std::string_view kMaxForce = "safety.max_force_n";

/// A quantity over time, of fields that an older trace may lack and that not every law has.
struct Quantity {
  std::string_view panel;
  std::string_view unit;
  std::string_view name;
  std::string_view colour;
  PlotCurve::Style style;
  double (*valueOf)(const rt::Tick& tick);
  std::array<std::string_view, 2> fields;
  /// Left out, without mention, where its panel is zero throughout or the trace's version did not have it.
  bool only_if_used = false;
};

using Style = PlotCurve::Style;
constexpr std::string_view kForce = "force";
constexpr std::string_view kComponents = "force per axis";
constexpr std::string_view kLatency = "wake-up latency";
constexpr std::string_view kFixtureForce = "force of fixtures";
constexpr std::array<Quantity, 8> kQuantities{
    {{kForce,
      "N",
      "magnitude",
      "#000000",
      Style::thick,
      [](const rt::Tick& tick) { return norm(tick.command_force_n_in_world); },
      {"command_force_n_in_world"}},
     {kComponents,
      "N",
      "x",
      "#c05020",
      Style::thin,
      [](const rt::Tick& tick) { return tick.command_force_n_in_world.x; },
      {"command_force_n_in_world"}},
     {kComponents,
      "N",
      "y",
      "#309030",
      Style::thin,
      [](const rt::Tick& tick) { return tick.command_force_n_in_world.y; },
      {"command_force_n_in_world"}},
     {kComponents,
      "N",
      "z",
      "#3060c0",
      Style::thin,
      [](const rt::Tick& tick) { return tick.command_force_n_in_world.z; },
      {"command_force_n_in_world"}},
     {kFixtureForce,
      "N",
      "fixtures",
      "#c05020",
      Style::thick,
      [](const rt::Tick& tick) { return norm(tick.fixture_force_n_in_world); },
      {"fixture_force_n_in_world"},
      true},
     {kFixtureForce,
      "N",
      "guidance",
      "#309030",
      Style::thick,
      [](const rt::Tick& tick) { return norm(tick.guidance_force_n_in_world); },
      {"guidance_force_n_in_world"},
      true},
     {"penetration",
      "mm",
      "penetration",
      "#303090",
      Style::thick,
      [](const rt::Tick& tick) { return 1000 * norm(tick.proxy_m_in_world - tick.hip_m_in_world); },
      {"proxy_m_in_world", "hip_m_in_world"}},
     {kLatency,
      "us",
      "latency",
      "#303090",
      Style::thick,
      [](const rt::Tick& tick) { return static_cast<double>(tick.wakeup_latency_ns) / 1000; },
      {"wakeup_latency_ns"}}}};

/// The value in a tick; NaN if the law in use does not have the quantity.
double valueAt(const Quantity& quantity, const trace::SelectedTrace& trace, const rt::Tick& tick) {
  const bool applies_here = std::ranges::all_of(
      quantity.fields, [&](std::string_view field) { return trace.fieldApplies(tick, field); });
  return applies_here ? quantity.valueOf(tick) : std::numeric_limits<double>::quiet_NaN();
}

struct Curve {
  const Quantity* quantity;
  std::vector<PlotPoint> points;
};

/// The content of a trace that is drawn.
struct Content {
  std::vector<Curve> curves;
  std::vector<std::string_view> lacking;  ///< panels that the trace's version did not record
  std::vector<std::string_view> foreign;  ///< panels that the laws in use do not have
  std::vector<PlotPoint> limits;          ///< limits of the force, each valid from its time on
  std::vector<PlotSpan> spans;
  std::vector<PlotEvent> events;
  std::size_t events_left_out = 0;
  std::uint64_t ticks = 0;
  double first_s = 0, last_s = 0;
};

void addOnce(std::vector<std::string_view>& names, std::string_view name) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

/// Prepares a curve for each quantity that the trace has.
Content contentFor(const trace::SelectedTrace& trace) {
  Content content;
  for (const Quantity& quantity : kQuantities) {
    const bool lacks = std::ranges::any_of(
        quantity.fields, [&trace](std::string_view field) { return trace.lacks<rt::Tick>(field); });
    if (lacks) {
      if (!quantity.only_if_used) addOnce(content.lacking, quantity.panel);
    } else {
      content.curves.push_back({&quantity, {}});
    }
  }
  return content;
}

/// Removes the quantities that no tick has.
void takeOutForeign(Content& content) {
  std::vector<std::string_view> used;
  for (const Curve& curve : content.curves) {
    // in a damaged trace a value may be anything
    const auto acts = [](const PlotPoint& p) {
      return std::abs(p.value) > kMinDrawn && std::isfinite(p.value);
    };
    if (std::ranges::any_of(curve.points, acts)) addOnce(used, curve.quantity->panel);
  }
  std::erase_if(content.curves, [&used](const Curve& curve) {
    return curve.quantity->only_if_used && std::ranges::find(used, curve.quantity->panel) == used.end();
  });
  std::erase_if(content.curves, [&content](const Curve& curve) {
    const bool foreign =
        std::ranges::any_of(curve.quantity->fields, trace::needsProxy) &&
        std::ranges::all_of(curve.points, [](const PlotPoint& p) { return std::isnan(p.value); });
    if (foreign) addOnce(content.foreign, curve.quantity->panel);
    return foreign;
  });
}

trace::Progress part(const trace::Progress& progress, double begin) {
  return progress ? trace::Progress([&progress, begin](double done) { progress(begin + done / 2); })
                  : trace::Progress();
}

/// Counts the ticks, and finds the limits of the force, which were set before the selected time too.
base::Result<void> readLimits(Content& content, const trace::SelectedTrace& trace,
                              const trace::Progress& progress) {
  const auto count = [&](const rt::Tick& tick) {
    if (trace.holds(tick.planned_ns)) ++content.ticks;
    return true;
  };
  const auto limit = [&](const trace::DirectiveRecord& directive) {
    for (const auto& [name, value] : directive.parameters) {
      const auto limit_n = name == kMaxForce ? trace::numberIn(value) : std::nullopt;
      if (!limit_n || (!content.limits.empty() && content.limits.back().value == *limit_n)) continue;
      content.limits.push_back({trace.seconds(directive.time_ns), *limit_n});
    }
    return true;
  };
  const auto info =
      trace::readTrace(trace.file(), {.tick = count, .directive = limit, .progress = part(progress, 0)});
  if (!info) return std::unexpected(info.error());
  if (!content.limits.empty()) return {};
  for (const trace::TraceSetting& setting : trace::settingsIn(trace::settingsText(*info))) {
    const auto limit_n = setting.name == kMaxForce ? trace::numberIn(setting.value) : std::nullopt;
    if (limit_n) content.limits.push_back({0, *limit_n});
  }
  return {};
}

PlotEvent eventOf(const trace::EventRecord& record, double time_s) {
  PlotEvent event{time_s, PlotEvent::Kind::other, base::printable(record.text)};
  for (const auto& [name, value] : record.fields) {
    if (record.kind == "mark" && name == "MARK") {
      event.kind = PlotEvent::Kind::mark;
      event.text = base::printable(value);
    }
    if (record.kind == "mode" && value == "faulted") event.kind = PlotEvent::Kind::fault;
  }
  return event;
}

base::Result<void> readCurves(Content& content, const trace::SelectedTrace& trace, std::size_t most,
                              const trace::Progress& progress) {
  std::vector<trace::Peaks<PlotPoint>> peaks;
  for (Curve& curve : content.curves) {
    peaks.emplace_back(content.ticks, most,
                       [&curve](const PlotPoint& point) { curve.points.push_back(point); });
  }
  const bool knows_mode = !trace.lacks<rt::Tick>("mode");
  bool first = true;
  const auto add = [&](const rt::Tick& tick) {
    const double time_s = trace.seconds(tick.planned_ns);
    if (first) content.first_s = time_s;
    first = false;
    content.last_s = time_s;
    for (std::size_t i = 0; i < content.curves.size(); ++i) {
      const double value = valueAt(*content.curves[i].quantity, trace, tick);
      peaks[i].add(value, {time_s, value});
    }
    if (!knows_mode) return true;
    const std::string_view mode = rt::wordOf(tick.mode);
    std::vector<PlotSpan>& spans = content.spans;
    if (!spans.empty()) spans.back().end_s = time_s;
    if (spans.empty() || (spans.back().mode != mode && spans.size() < kMaxSpans)) {
      spans.push_back({time_s, time_s, std::string(mode)});
    }
    return true;
  };
  const auto note = [&](const trace::EventRecord& record) {
    const bool room = content.events.size() < kMaxEventLines || record.kind == "mark";
    if (room) {
      content.events.push_back(eventOf(record, trace.seconds(record.time_ns)));
    } else {
      ++content.events_left_out;
    }
    return true;
  };
  auto read = trace.readAll({.tick = add, .event = note}, part(progress, 0.5));
  if (!read) return std::unexpected(read.error());
  for (trace::Peaks<PlotPoint>& curve : peaks) curve.finish();
  return {};
}

/// The limit of the force as a curve through the selected time.
PlotCurve limitCurve(const Content& content, double last_s) {
  PlotCurve curve{"limit", "#d02020", Style::limit, {}};
  for (const PlotPoint& limit : content.limits) {
    if (limit.time_s > last_s) break;
    if (limit.time_s <= content.first_s) curve.points.clear();
    curve.points.push_back({std::max(limit.time_s, content.first_s), limit.value});
  }
  // gnuplot's steps lead from each point to the next one: the last value goes on to the end
  if (!curve.points.empty()) curve.points.push_back({last_s, curve.points.back().value});
  return curve;
}

std::vector<PlotPanel> panelsOf(Content& content, double last_s) {
  std::vector<PlotPanel> panels;
  for (Curve& curve : content.curves) {
    const Quantity& quantity = *curve.quantity;
    if (panels.empty() || panels.back().name != quantity.panel) {
      panels.push_back(
          {std::string(quantity.panel), std::string(quantity.unit), {}, quantity.panel == kLatency});
    }
    panels.back().curves.push_back(
        {std::string(quantity.name), std::string(quantity.colour), quantity.style, std::move(curve.points)});
  }
  if (PlotCurve limit = limitCurve(content, last_s); panels.front().name == kForce && !limit.points.empty()) {
    panels.front().curves.push_back(std::move(limit));
  }
  return panels;
}

std::string titleOf(const std::filesystem::path& trace, const Content& content) {
  std::string title = base::printable(trace.filename().string());
  if (!content.lacking.empty())
    title += fmt::format(", of another version: no {}", fmt::join(content.lacking, ", "));
  if (!content.foreign.empty())
    title += fmt::format(", of a law without a proxy: no {}", fmt::join(content.foreign, ", "));
  return title;
}

std::string subtitleOf(const trace::SelectedTrace& trace, const Content& content) {
  const auto begin = static_cast<std::time_t>(trace.realtimeSeconds(trace.start_ns()));
  std::string text =
      fmt::format("0 s is {:%Y-%m-%d %H:%M:%S} UTC; {} ticks", fmt::gmtime(begin), content.ticks);
  if (content.events_left_out > 0) text += fmt::format("; {} events not drawn", content.events_left_out);
  return text;
}

base::Error nothingToDraw(const std::filesystem::path& trace) {
  return {trace.string(), "has none of the quantities that are drawn",
          "export it instead: hapticctl trace export"};
}

constexpr std::array<std::string_view, 3> kEndings{".png", ".svg", ".pdf"};

/// Reads the selection. Errors: those of readTrace(), nothing to draw.
base::Result<Plot> plotOf(const trace::SelectedTrace& trace, const trace::TraceSelection& selection,
                          const trace::Progress& progress) {
  Content content = contentFor(trace);
  if (content.curves.empty()) return std::unexpected(nothingToDraw(trace.file()));
  if (auto read = readLimits(content, trace, progress); !read) return std::unexpected(read.error());
  const std::size_t most = selection.most_ticks == 0 ? kUsualPoints : selection.most_ticks;
  if (auto read = readCurves(content, trace, most, progress); !read) return std::unexpected(read.error());
  if (content.curves.front().points.empty()) {
    return std::unexpected(
        base::Error{trace.file().string(), "has no ticks in that time", "choose another stretch"});
  }
  takeOutForeign(content);
  if (content.curves.empty()) return std::unexpected(nothingToDraw(trace.file()));
  const double last_s = std::max(content.last_s, content.first_s + kMin_s);
  std::vector<PlotPanel> panels = panelsOf(content, last_s);
  // a trace also holds events from before its first tick, and damaged or foreign files any times
  std::erase_if(content.events, [&](const PlotEvent& event) {
    return event.time_s < content.first_s || event.time_s > last_s;
  });
  return Plot{titleOf(trace.file(), content), subtitleOf(trace, content), content.first_s,          last_s,
              std::move(content.spans),       std::move(panels),          std::move(content.events)};
}

}  // namespace

base::Result<void> plotTrace(const std::filesystem::path& trace_file, const std::filesystem::path& image,
                             const trace::TraceSelection& selection, const trace::Progress& progress,
                             base::IfExists if_exists) {
  if (auto known = base::checkEnding(image, kEndings); !known) return known;
  const auto trace = trace::SelectedTrace::open(trace_file, selection);
  if (!trace) return std::unexpected(trace.error());
  if (auto ticks = trace->requireTicks(); !ticks) return ticks;
  auto file = base::WholeFile::create(image, if_exists);
  if (!file) return std::unexpected(file.error());
  const auto plot = plotOf(*trace, selection, progress);
  if (!plot) return std::unexpected(plot.error());
  const auto drawn =
      drawnByGnuplot(plotScript(*plot, gnuplotTerminal(image)), "The Debian package is gnuplot-nox.");
  if (!drawn) return std::unexpected(drawn.error());
  if (auto written = file->append(*drawn); !written) return written;
  return file->finish();
}

}  // namespace hapticd::tools
