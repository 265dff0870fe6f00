// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/strokes/strokes_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/hapticbench/strokes/strokes_requirements.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::json;

constexpr const char* kExplanation =
    "Strokes over bodies that are known exactly, at 0.1 m/s, with 30 frames and 1000 ticks per second;\n"
    "the truth is an ideal constraint without friction at the time of each tick.\n"
    "rms N, JND:  error of the law's force, in just noticeable differences too; hand: JND after the blend\n"
    "floor:       the error over the least that the camera's noise allows\n"
    "lost:        share of the contact in which no force was felt\n"
    "along:       the error along the stroke, newtons, and over the floor of the surface's tilt\n"
    "lag:         of the proxy along the stroke, millimetres; strokes whose proxy stopped or lagged\n"
    "ghost:       force on a HIP that touches nothing, and share of the ticks above 0.1 N\n"
    "wrong:       share of the contact in which the force pointed into the body\n"
    "end:         where contact ended beyond the end of the body, earliest and latest, and in pixel "
    "pitches\n\n";

std::string endText(const EndSpread& end) {
  if (end.ends == 0) return "";
  return fmt::format(" {:+.1f} {:+.1f} mm {:.1f} px", 1000 * end.earliest_m, 1000 * end.latest_m,
                     end.worst_pitches);
}

std::string ratioText(const std::optional<double>& ratio) {
  return ratio ? fmt::format("{:.2f}", *ratio) : "-";
}

void addLagging(fmt::memory_buffer& text, const std::vector<StrokesRow>& rows) {
  constexpr std::size_t kShown = 6;
  for (const StrokesRow& row : rows) {
    if (row.lagging.empty()) continue;
    fmt::format_to(std::back_inserter(text), "{} {} {:g} m {}: {} lag\n", row.law, row.scene.name,
                   row.distance_m, nameOf(row.noise), row.lagging.size());
    for (std::size_t i = 0; i < std::min(kShown, row.lagging.size()); ++i) {
      fmt::format_to(std::back_inserter(text), "    {}\n", row.lagging[i]);
    }
  }
}

void addBounds(fmt::memory_buffer& text, const std::vector<StrokesRow>& rows) {
  fmt::format_to(std::back_inserter(text), "\nbounds\n");
  for (const StrokesRequirement& one : strokesRequirements(rows)) {
    const std::string verdict =
        one.violated == 0 ? "kept" : fmt::format("NOT KEPT by {} of {}", one.violated, one.rows);
    fmt::format_to(std::back_inserter(text), "{:<8} {:<86} {:<22} worst {}\n", one.law, one.text, verdict,
                   one.worst);
  }
}

Json ratioJson(const std::optional<double>& ratio) {
  return ratio ? Json(*ratio) : Json();
}

Json spreadJson(const Spread& spread) {
  return {{"rms", spread.rms()}, {"max", spread.max()}};
}

void addRow(fmt::memory_buffer& text, const StrokesRow& row) {
  const StrokeFigures& f = row.figures;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{:<15}{:<13}{:>5.2f}  {:<8}{:>3} ", row.law, row.scene.name, row.distance_m,
                 nameOf(row.noise), f.strokes);
  fmt::format_to(out, "|{:>6.2f}{:>6.2f}{:>6.2f}{:>6} |{:>7.2f} ", f.error.error_n.rms(),
                 f.error.error_jnd.rms(), f.blended.error_jnd.rms(), ratioText(row.errorByFloor()),
                 f.lostPercent());
  fmt::format_to(out, "|{:>10.2f}{:>6.2f}{:>6} |{:>6.1f}{:>6.1f}{:>5}{:>4} ", f.along_n.max(),
                 f.along_n.rms(), ratioText(row.alongByFloor()), 1000 * f.lag_m, 1000 * row.lag_limit_m,
                 f.stopped, f.lagged);
  fmt::format_to(out, "|{:>8.2f}{:>6.1f} |{:>8.2f} | {}{}", f.ghost_n, f.ghostPercent(), f.wrongSidePercent(),
                 row.variant, endText(f.end));
  if (f.outside_model_ticks > 0) fmt::format_to(out, "  {} ticks outside the model", f.outside_model_ticks);
  fmt::format_to(out, "\n");
}

}  // namespace

std::string strokesTable(const std::vector<StrokesRow>& rows) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{}", kExplanation);
  fmt::format_to(
      out,
      "law            scene         dist  noise     n | rms N   JND  hand floor | lost % | along max   rms "
      "|   lag limit stop lag | ghost N     % | wrong % | end\n");
  for (const StrokesRow& row : rows) addRow(text, row);
  addLagging(text, rows);
  addBounds(text, rows);
  return fmt::to_string(text);
}

std::string strokesJson(const std::vector<StrokesRow>& rows) {
  Json document{{"benchmark", "strokes"}};
  Json& list = document["rows"] = Json::array();
  for (const StrokesRow& row : rows) {
    const StrokeFigures& f = row.figures;
    Json json{{"law", row.law},
              {"scene", row.scene.name},
              {"variant", row.variant},
              {"distance_m", row.distance_m},
              {"noise", nameOf(row.noise)},
              {"strokes", f.strokes},
              {"error_n", spreadJson(f.error.error_n)},
              {"error_jnd", spreadJson(f.error.error_jnd)},
              {"blended_error_jnd", spreadJson(f.blended.error_jnd)},
              {"normal_n", spreadJson(f.normal_n)},
              {"error_by_floor", ratioJson(row.errorByFloor())},
              {"along_by_floor", ratioJson(row.alongByFloor())},
              {"lagging", row.lagging},
              {"contact_ticks", f.contact_ticks},
              {"lost_percent", f.lostPercent()},
              {"along_n", spreadJson(f.along_n)},
              {"lag_mm", 1000 * f.lag_m},
              {"lag_limit_mm", 1000 * row.lag_limit_m},
              {"stopped", f.stopped},
              {"lagged", f.lagged},
              {"free_ticks", f.free_ticks},
              {"ghost_n", f.ghost_n},
              {"ghost_percent", f.ghostPercent()},
              {"wrong_side_percent", f.wrongSidePercent()},
              {"ticks_outside_model", f.outside_model_ticks}};
    if (f.end.ends > 0) {
      json["end_mm"] = {1000 * f.end.earliest_m, 1000 * f.end.latest_m};
      json["end_px"] = f.end.worst_pitches;
    }
    list.push_back(std::move(json));
  }
  Json& requirements = document["requirements"] = Json::array();
  for (const StrokesRequirement& one : strokesRequirements(rows)) {
    requirements.push_back({{"law", one.law},
                            {"text", one.text},
                            {"rows", one.rows},
                            {"violated", one.violated},
                            {"worst", one.worst}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
