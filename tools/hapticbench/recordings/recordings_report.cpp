#include "tools/hapticbench/recordings/recordings_report.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/force_series.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

double percentOf(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

double jndOf(const SurfaceError& error) {
  return rootMeanSquare(error.error_n) / justNoticeableDifference_n(error.largest_true_n);
}

void addSurfaceRow(fmt::memory_buffer& text, const SurfaceRow& row) {
  fmt::format_to(std::back_inserter(text),
                 "{:<24}{:<8}{:>5.2f}{:>6.2f}{:>5.0f},{:>3.0f} |{:>6.2f}{:>7.2f} |{:>7.2f}{:>7.2f}{:>6.1f}"
                 "{:>6.1f}{:>7.2f} |{:>7.2f}{:>7.2f}{:>6.1f}{:>8.3f}{:>7.3f}\n",
                 row.session, nameOf(row.law), row.surface.size_m, row.surface.distance_m, row.surface.column,
                 row.surface.row, row.surface.residual_raw, row.stiffness_n_per_m * row.surface.fit_error_m,
                 rootMeanSquare(row.stroke.error_n), jndOf(row.stroke),
                 percentOf(row.stroke.lost, row.stroke.error_n.size()),
                 percentOf(row.stroke.zero, row.stroke.error_n.size()), rootMeanSquare(row.stroke.along_n),
                 rootMeanSquare(row.still.error_n), jndOf(row.still),
                 percentOf(row.still.lost, row.still.error_n.size()), quantile(row.still.new_frame_n, 0.5),
                 quantile(row.still.new_frame_n, 0.99));
}

}  // namespace

std::string recordingsTable(std::span<const SessionResult> sessions, const RecordingsOptions&) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "{:<24}{:<8}{:>5}{:>6}{:>9} |{:>6}{:>7} |{:>7}{:>7}{:>6}{:>6}{:>7} |{:>7}{:>7}{:>6}{:>8}"
                 "{:>7}\n",
                 "session", "law", "size", "m", "pixel", "raw", "fit N", "rms N", "JND", "lost%", "zero%",
                 "along", "still N", "JND", "lost%", "step N", "p99");
  for (const SessionResult& session : sessions) {
    for (const SurfaceRow& row : session.surfaces) addSurfaceRow(text, row);
  }
  return fmt::to_string(text);
}

std::string recordingsJson(std::span<const SessionResult> sessions) {
  Json document;
  for (const SessionResult& session : sessions) document["sessions"].push_back(session.session);
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
