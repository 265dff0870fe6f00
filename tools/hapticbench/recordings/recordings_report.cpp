// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/recordings_report.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/force_series.h"
#include "tools/hapticbench/recordings/recordings_bounds.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kExplanation =
    "Resting surfaces, known by a robust quadratic in disparity through the mean of the whole session: the\n"
    "hand presses 8 mm deep and strokes up to 100 mm at 0.1 m/s, along row and column, or stays for two\n"
    "seconds. raw: what the mean image deviates from the fit. fit N: standard error of the fit itself, "
    "times\n"
    "k_s; an error below it says nothing. lost: ticks with less than a tenth of the true force; zero: with\n"
    "none. along: force along the stroke, RMS. step: change of the law's force at a new frame while the HIP\n"
    "is still, before any blend.\n";

constexpr const char* kPassingExplanation =
    "Places on what rests that something passes, the session played forwards and backwards. free: a HIP\n"
    "30 mm in front; force above 0.1 N, of all ticks and of those while something passes. pressing: a HIP\n"
    "6 mm behind; the longest time above 0.5 N while something passes, of the error and of the change from\n"
    "the mean while nothing passes; calm: of that change while nothing passes, the sensor's own noise.\n"
    "left out: ticks with something measured within 20 mm of the HIP.\n";

double percentOf(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

/// The figures of an error on surfaces.
struct ErrorFigures {
  double rms_n;
  double jnd;
  double lost_percent;
  double zero_percent;
  double along_n;
  double step_n;
  double step_p99_n;

  static ErrorFigures of(const SurfaceError& error) {
    const double rms_n = rootMeanSquare(error.error_n);
    return {.rms_n = rms_n,
            .jnd = rms_n / justNoticeableDifference_n(error.largest_true_n),
            .lost_percent = percentOf(error.lost, error.error_n.size()),
            .zero_percent = percentOf(error.zero, error.error_n.size()),
            .along_n = rootMeanSquare(error.along_n),
            .step_n = quantile(error.new_frame_n, 0.5),
            .step_p99_n = quantile(error.new_frame_n, 0.99)};
  }
};

void addFigureHeads(fmt::memory_buffer& text) {
  fmt::format_to(std::back_inserter(text), " |{:>8}{:>7}{:>7}{:>7}{:>7} |{:>8}{:>7}{:>7} |{:>8}{:>8}\n",
                 "rms N", "JND", "lost %", "zero %", "along", "still N", "JND", "lost %", "step N", "99 %");
}

void addFigureColumns(fmt::memory_buffer& text, const SurfaceError& stroke, const SurfaceError& still) {
  const ErrorFigures s = ErrorFigures::of(stroke);
  const ErrorFigures h = ErrorFigures::of(still);
  fmt::format_to(std::back_inserter(text),
                 " |{:>8.2f}{:>7.2f}{:>7.1f}{:>7.1f}{:>7.2f} |{:>8.2f}{:>7.2f}{:>7.1f} |{:>8.3f}{:>8.3f}\n",
                 s.rms_n, s.jnd, s.lost_percent, s.zero_percent, s.along_n, h.rms_n, h.jnd, h.lost_percent,
                 h.step_n, h.step_p99_n);
}

void addSurfaces(fmt::memory_buffer& text, std::span<const SessionResult> sessions) {
  fmt::format_to(std::back_inserter(text), "{:<24}{:<8}{:>6}{:>6}{:>10}{:>6}{:>7}", "session", "law",
                 "size m", "at m", "pixel", "raw", "fit N");
  addFigureHeads(text);
  for (const SessionResult& session : sessions) {
    for (const SurfaceRow& row : session.surfaces) {
      const RestingSurface& surface = row.surface;
      fmt::format_to(std::back_inserter(text), "{:<24}{:<8}{:>6.2f}{:>6.2f}{:>6.0f},{:>3.0f}{:>6.2f}{:>7.2f}",
                     row.session, nameOf(row.law), surface.size_m, surface.distance_m, surface.column,
                     surface.row, surface.residual_raw, row.stiffness_n_per_m * surface.fit_error_m);
      addFigureColumns(text, row.stroke, row.still);
    }
  }
}

void addDistances(fmt::memory_buffer& text, const std::vector<DistanceClassResult>& results) {
  fmt::format_to(std::back_inserter(text), "\n{:<8}{:>12}{:>10}{:>7}", "law", "distance m", "surfaces",
                 "fit N");
  addFigureHeads(text);
  for (const DistanceClassResult& result : results) {
    fmt::format_to(std::back_inserter(text), "{:<8}{:>7.2f}-{:<4.2f}{:>10}{:>7.2f}", nameOf(result.law),
                   result.from_m, result.to_m, result.surfaces, result.fit_error_n);
    addFigureColumns(text, result.stroke, result.still);
  }
}

void addPassings(fmt::memory_buffer& text, std::span<const SessionResult> sessions) {
  fmt::format_to(std::back_inserter(text),
                 "{:<24}{:<8}{:>7}{:>12} |{:>9}{:>8}{:>8}{:>7}{:>9} |{:>9}{:>8}{:>9}{:>8}{:>8}{:>9}\n",
                 "session", "law", "places", "at m", "free N", "% >0.1", "passed", "ms", "left out",
                 "press N", "ms>0.5", "change N", "ms>0.5", "calm ms", "left out");
  for (const SessionResult& session : sessions) {
    for (const PassingRow& row : session.passings) {
      fmt::format_to(std::back_inserter(text),
                     "{:<24}{:<8}{:>7}{:>7.2f}-{:<4.2f} |{:>9.3f}{:>8.2f}{:>8.2f}{:>7}{:>9} "
                     "|{:>9.3f}{:>8}{:>9.3f}{:>8}{:>8}{:>9}\n",
                     row.session, nameOf(row.law), row.places, row.nearest_m, row.farthest_m,
                     row.free.ghost.largest, row.free.ghost.percent(), row.free.ghost_covered.percent(),
                     row.free.ghost.longest, row.free.left_out, row.pressing.error.largest,
                     row.pressing.error.longest, row.pressing.change.largest, row.pressing.change.longest,
                     row.pressing.calm.longest, row.pressing.left_out);
    }
  }
}

Json errorJson(const SurfaceError& error) {
  const ErrorFigures figures = ErrorFigures::of(error);
  return {{"ticks", error.error_n.size()},
          {"rms_n", figures.rms_n},
          {"jnd", figures.jnd},
          {"lost_percent", figures.lost_percent},
          {"zero_percent", figures.zero_percent},
          {"along_rms_n", figures.along_n},
          {"new_frames", error.new_frame_n.size()},
          {"step_median_n", figures.step_n},
          {"step_p99_n", figures.step_p99_n}};
}

Json exceedanceJson(const Exceedance& values) {
  return {{"ticks", values.ticks},
          {"above_percent", values.percent()},
          {"longest_ms", values.longest},
          {"largest_n", values.largest}};
}

Json surfaceJson(const SurfaceRow& row) {
  return {{"law", nameOf(row.law)},
          {"size_m", row.surface.size_m},
          {"distance_m", row.surface.distance_m},
          {"column", row.surface.column},
          {"row", row.surface.row},
          {"residual_raw", row.surface.residual_raw},
          {"fit_error_n", row.stiffness_n_per_m * row.surface.fit_error_m},
          {"stroke", errorJson(row.stroke)},
          {"still", errorJson(row.still)}};
}

Json passingJson(const PassingRow& row) {
  return {{"law", nameOf(row.law)},
          {"places", row.places},
          {"nearest_m", row.nearest_m},
          {"farthest_m", row.farthest_m},
          {"free", exceedanceJson(row.free.ghost)},
          {"free_passed", exceedanceJson(row.free.ghost_covered)},
          {"free_left_out", row.free.left_out},
          {"pressing_error", exceedanceJson(row.pressing.error)},
          {"pressing_change", exceedanceJson(row.pressing.change)},
          {"pressing_calm", exceedanceJson(row.pressing.calm)},
          {"pressing_left_out", row.pressing.left_out}};
}

}  // namespace

std::string recordingsTable(std::span<const SessionResult> sessions, const RecordingsOptions& options) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "{}\n", kExplanation);
  addSurfaces(text, sessions);
  addDistances(text, byDistance(sessions, options, 0));
  fmt::format_to(std::back_inserter(text), "\n{}\n", kPassingExplanation);
  addPassings(text, sessions);
  fmt::format_to(std::back_inserter(text), "\nwhat must hold\n{}",
                 boundsTable(recordingsBounds(sessions, options)));
  return fmt::to_string(text);
}

std::string recordingsJson(std::span<const SessionResult> sessions, const RecordingsOptions& options) {
  Json document;
  document["sessions"] = Json::array();
  for (const SessionResult& session : sessions) {
    Json of_session{{"session", session.session},
                    {"frames", session.frames},
                    {"surfaces", Json::array()},
                    {"passings", Json::array()}};
    for (const SurfaceRow& row : session.surfaces) of_session["surfaces"].push_back(surfaceJson(row));
    for (const PassingRow& row : session.passings) of_session["passings"].push_back(passingJson(row));
    document["sessions"].push_back(std::move(of_session));
  }
  document["bounds"] = Json::parse(boundsJson(recordingsBounds(sessions, options)));
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
