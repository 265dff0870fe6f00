// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/plot/gnuplot.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

#include "config/base/descriptor.h"
#include "config/base/whole_file.h"

namespace hapticd::tools {
namespace {

/// A file in memory: gnuplot's own writes to a disk would fail silently.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(::memfd_create("gnuplot", MFD_CLOEXEC)) {}
  int descriptor() const { return descriptor_.get(); }

  /// Fills it and goes back to its beginning.
  bool fill(std::string_view text) {
    while (!text.empty()) {
      const ssize_t count = ::write(descriptor(), text.data(), text.size());
      if (count < 0) return false;
      text.remove_prefix(static_cast<std::size_t>(count));
    }
    return ::lseek(descriptor(), 0, SEEK_SET) == 0;
  }

  std::string content() {
    std::string content;
    std::array<char, 1 << 16> part;
    ssize_t count = ::lseek(descriptor(), 0, SEEK_SET) == 0 ? 1 : 0;
    while (count > 0) {
      count = ::read(descriptor(), part.data(), part.size());
      if (count > 0) content.append(part.data(), static_cast<std::size_t>(count));
    }
    return content;
  }

 private:
  base::Descriptor descriptor_;
};

bool succeeds(const MemoryFile& script, const MemoryFile& image) {
  posix_spawn_file_actions_t streams;
  ::posix_spawn_file_actions_init(&streams);
  ::posix_spawn_file_actions_adddup2(&streams, script.descriptor(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&streams, image.descriptor(), STDOUT_FILENO);
  std::string program = "gnuplot", from_input = "-";
  char* arguments[] = {program.data(), from_input.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  const bool started = ::posix_spawnp(&child, "gnuplot", &streams, nullptr, arguments, environ) == 0;
  ::posix_spawn_file_actions_destroy(&streams);
  while (started && ::waitpid(child, &status, 0) != child) {
    if (errno != EINTR) return false;
  }
  return started && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

std::string gnuplotQuoted(const std::string& text) {
  std::string quoted;
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted;
}

const char* gnuplotTerminal(const std::filesystem::path& image) {
  const auto ends_in = [&image](std::string_view ending) {
    return base::checkEnding(image, std::array{ending}).has_value();
  };
  return ends_in(".png") ? "pngcairo" : ends_in(".pdf") ? "pdfcairo" : "svg";
}

base::Result<std::string> drawnByGnuplot(const std::string& script, const std::string& remedy) {
  MemoryFile text, image;
  if (text.fill(script) && succeeds(text, image)) {
    std::string content = image.content();
    if (!content.empty()) return content;
  }
  return std::unexpected(base::Error{"gnuplot", "draws nothing", "is gnuplot installed? " + remedy});
}

base::Result<void> runGnuplot(const std::string& script, const std::filesystem::path& image,
                              const std::string& remedy) {
  const auto drawn = drawnByGnuplot(script, remedy);
  if (!drawn) return std::unexpected(drawn.error());
  return base::writeWholeFile(image, *drawn, base::IfExists::replace);
}

namespace {

// Measures of the picture in pixels.
constexpr int kWidth = 1400;
/// Width of a PDF: the text of an A4 page. Its fonts are as large there as in print.
constexpr double kPaperWidth_cm = 17;
constexpr int kTitle = 70;
constexpr int kStrip = 30;
constexpr int kPanel = 240;
constexpr int kGap = 46;  // room for the legend of the panel below
constexpr int kAxis = 60;
constexpr int kLegendGap = 4;

constexpr std::string_view kMarkColour = "#1060d0";
constexpr std::string_view kFaultColour = "#d02020";
constexpr std::string_view kEventColour = "#b0b0b0";
/// A span narrower than this share of the picture has no room for its name.
constexpr double kNarrowestNamed = 0.06;
constexpr std::size_t kMaxMarkLength = 40;

std::string_view colourOfMode(std::string_view mode) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kColours{{{"starting", "#d0d0d0"},
                                                                                   {"idle", "#e8e8e8"},
                                                                                   {"engaged", "#a8d8a8"},
                                                                                   {"holding", "#f0d890"},
                                                                                   {"faulted", "#f0a0a0"}}};
  const auto found = std::ranges::find(kColours, mode, [](const auto& pair) { return pair.first; });
  return found == kColours.end() ? "#ffffff" : found->second;
}

std::string_view colourOf(PlotEvent::Kind kind) {
  if (kind == PlotEvent::Kind::mark) return kMarkColour;
  return kind == PlotEvent::Kind::fault ? kFaultColour : kEventColour;
}

int heightOf(const Plot& plot) {
  return kTitle + kStrip + static_cast<int>(plot.panels.size()) * (kGap + kPanel) + kAxis;
}

/// Writes a script.
class Script {
 public:
  explicit Script(const Plot& plot) : plot_(plot), height_(heightOf(plot)) {}

  std::string of(const std::string& terminal) {
    addData();
    if (terminal == "pdfcairo") {
      const double cm_per_px = kPaperWidth_cm / kWidth;
      add("set terminal {} size {}cm,{}cm font 'Sans,7' fontscale 1 linewidth 0.6 background rgb 'white'\n",
          terminal, kPaperWidth_cm, height_ * cm_per_px);
    } else {
      add("set terminal {} size {},{} font 'Sans,11' background rgb 'white'\n", terminal, kWidth, height_);
    }
    add("set multiplot\nset lmargin at screen 0.08\nset rmargin at screen 0.97\nset xrange [{}:{}]\n",
        plot_.first_s, plot_.last_s);
    add("set label 1 '{}' at screen 0.08,{} left noenhanced font 'Sans,14'\n", gnuplotQuoted(plot_.title),
        screen(22));
    add("set label 2 '{}' at screen 0.08,{} left noenhanced\n", gnuplotQuoted(plot_.subtitle), screen(46));
    addStrip();
    int top = kTitle + kStrip + kGap;
    for (std::size_t i = 0; i < plot_.panels.size(); ++i, top += kPanel + kGap) addPanel(i, top);
    add("unset multiplot\n");
    return std::move(text_);
  }

 private:
  template <typename... Arguments>
  void add(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Arguments>(arguments)...);
  }

  /// Pixels from the top as a share of the height, which gnuplot counts from below.
  double screen(int pixels) const { return 1 - static_cast<double>(pixels) / height_; }

  void addData() {
    for (std::size_t panel = 0; panel < plot_.panels.size(); ++panel) {
      const std::vector<PlotCurve>& curves = plot_.panels[panel].curves;
      for (std::size_t curve = 0; curve < curves.size(); ++curve) {
        add("$data{}_{} << END\n", panel, curve);
        for (const PlotPoint& point : curves[curve].points) {
          if (std::isfinite(point.value)) {
            add("{} {}\n", point.time_s, point.value);
          } else {
            add("\n");
          }
        }
        add("END\n");
      }
    }
  }

  /// Places a panel, with its legend in a row above its right end.
  void addBorders(int top, int height) {
    add("set tmargin at screen {}\nset bmargin at screen {}\n", screen(top), screen(top + height));
    add("set key at screen 0.97,screen {} right bottom horizontal maxrows 1 samplen 2 noenhanced\n",
        screen(top - kLegendGap));
  }

  void addStrip() {
    addBorders(kTitle, kStrip);
    add("set yrange [0:1]\nunset ytics\nset format x ''\n"
        "set ylabel 'mode' rotate by 0 offset -1,0\n");
    int object = 1;
    for (const PlotSpan& span : plot_.spans) {
      add("set object {} rectangle from first {},graph 0 to first {},graph 1 fillcolor rgb '{}' fillstyle "
          "solid noborder behind\n",
          object++, span.begin_s, span.end_s, colourOfMode(span.mode));
      if (span.end_s - span.begin_s < kNarrowestNamed * (plot_.last_s - plot_.first_s)) continue;
      add("set label '{}' at first {},graph 0.5 center noenhanced\n", gnuplotQuoted(span.mode),
          (span.begin_s + span.end_s) / 2);
    }
    addLines();
    add("plot -1 notitle");
    addKey(PlotEvent::Kind::mark, "mark");
    addKey(PlotEvent::Kind::fault, "fault");
    addKey(PlotEvent::Kind::other, "other event");
    add("\nunset label\nunset object\n");
  }

  void addKey(PlotEvent::Kind kind, const char* name) {
    if (std::ranges::find(plot_.events, kind, &PlotEvent::kind) == plot_.events.end()) return;
    add(", keyentry with lines lc rgb '{}' title '{}'", colourOf(kind), name);
  }

  void addLines() {
    add("unset arrow\n");
    for (const PlotEvent& event : plot_.events) {
      add("set arrow from first {0},graph 0 to first {0},graph 1 nohead back lc rgb '{1}'\n", event.time_s,
          colourOf(event.kind));
    }
  }

  void addPanel(std::size_t number, int top) {
    const PlotPanel& panel = plot_.panels[number];
    addBorders(top, kPanel);
    add("set ytics\nset grid back lt 1 lw 1 lc rgb '#e0e0e0'\n"
        "set ylabel '{} ({})' rotate by 90 offset 0,0\n{}\n{}\n",
        panel.name, panel.unit, rangeOf(panel), isLogarithmic(panel) ? "set logscale y" : "unset logscale y");
    if (number + 1 == plot_.panels.size())
      add("set format x '%g'\nset xlabel 'time since the first tick (s)'\n");
    if (number == 0) addMarkTexts();
    const char* separator = "plot ";
    for (std::size_t i = 0; i < panel.curves.size(); ++i) {
      const PlotCurve& curve = panel.curves[i];
      const bool limit = curve.style == PlotCurve::Style::limit;
      add("{}$data{}_{} with {} lc rgb '{}' lw {} {}{}", separator, number, i, limit ? "steps" : "lines",
          curve.colour, curve.style == PlotCurve::Style::thick ? 1.8 : 1.0, limit ? "dt 2 " : "",
          panel.curves.size() == 1 ? "notitle" : "title '" + gnuplotQuoted(curve.name) + "'");
      separator = ", ";
    }
    add("\nunset label\n");
  }

  void addMarkTexts() {
    for (const PlotEvent& event : plot_.events) {
      if (event.kind != PlotEvent::Kind::mark) continue;
      std::string text = event.text;
      if (text.size() > kMaxMarkLength) {
        std::size_t end = kMaxMarkLength;
        while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
        text = text.substr(0, end) + "...";
      }
      add("set label '{}' at first {},graph 0.96 right rotate by 90 offset -0.6,0 noenhanced textcolor rgb "
          "'{}' "
          "front\n",
          gnuplotQuoted(text), event.time_s, kMarkColour);
    }
  }

  static bool isLogarithmic(const PlotPanel& panel) {
    return panel.logarithmic && std::ranges::any_of(panel.curves, [](const PlotCurve& curve) {
             return std::ranges::any_of(curve.points, [](const PlotPoint& point) {
               return std::isfinite(point.value) && point.value > 0;
             });
           });
  }

  /// The range of a panel's axis: gnuplot's own choice, except that curves of a single value need a height
  /// too.
  static std::string rangeOf(const PlotPanel& panel) {
    double least = std::numeric_limits<double>::infinity(), largest = -least;
    for (const PlotCurve& curve : panel.curves) {
      for (const PlotPoint& point : curve.points) {
        if (!std::isfinite(point.value)) continue;
        least = std::min(least, point.value);
        largest = std::max(largest, point.value);
      }
    }
    const double height = std::max(1.0, 0.1 * std::abs(least));  // not lost beside a huge value
    return least == largest ? fmt::format("set yrange [{}:{}]", least, least + height)
                            : "unset yrange\nset autoscale y\nset offsets 0,0,graph 0.05,0";
  }

  const Plot& plot_;
  int height_;
  std::string text_;
};

}  // namespace

std::string plotScript(const Plot& plot, const std::string& terminal) {
  return Script(plot).of(terminal);
}

}  // namespace hapticd::tools
