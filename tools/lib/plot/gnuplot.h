// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/base/error.h"

namespace hapticd::tools {

/// `text` as gnuplot reads it between single quotes.
std::string gnuplotQuoted(const std::string& text);

/// "pngcairo", "pdfcairo" or "svg", by the ending of the image.
const char* gnuplotTerminal(const std::filesystem::path& image);

/// The image that gnuplot makes of `script`, which sets a terminal and leaves the output at standard output.
/// Errors: gnuplot is not installed, refuses the script or makes nothing; `remedy` ends the message.
base::Result<std::string> drawnByGnuplot(const std::string& script, const std::string& remedy);

/// Writes that image to a file, completely or not at all; an existing file is replaced.
base::Result<void> runGnuplot(const std::string& script, const std::filesystem::path& image,
                              const std::string& remedy);

struct PlotPoint {
  double time_s = 0;
  double value = 0;
};

struct PlotCurve {
  enum class Style { thick, thin, limit };
  std::string name;    ///< in the legend
  std::string colour;  ///< "#rrggbb"
  Style style = Style::thin;
  std::vector<PlotPoint> points;  ///< gaps where the value is not finite; a limit holds until its next point
};

/// Curves over time on one axis.
struct PlotPanel {
  std::string name;
  std::string unit;
  std::vector<PlotCurve> curves;
  /// A logarithmic axis, where any value is positive; others are not drawn.
  bool logarithmic = false;
};

/// How long the force loop was in a mode.
struct PlotSpan {
  double begin_s = 0;
  double end_s = 0;
  std::string mode;
};

/// A vertical line through all panels.
struct PlotEvent {
  enum class Kind { mark, fault, other };
  double time_s = 0;
  Kind kind = Kind::other;
  std::string text;  ///< shown beside a mark
};

/// A picture of a stretch of a trace: a strip with the modes on top, below it the panels.
struct Plot {
  std::string title;
  std::string subtitle;
  double first_s = 0;
  double last_s = 0;  ///< after first_s
  std::vector<PlotSpan> spans;
  std::vector<PlotPanel> panels;  ///< at least one
  std::vector<PlotEvent> events;
};

/// The script with which gnuplot draws it, 1400 px or, as a PDF, 17 cm wide. terminal: of gnuplotTerminal().
std::string plotScript(const Plot& plot, const std::string& terminal);

}  // namespace hapticd::tools
