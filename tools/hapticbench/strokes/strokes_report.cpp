#include "tools/hapticbench/strokes/strokes_report.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/hapticbench/accuracy/accuracy_study.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::json;

constexpr const char* kExplanation =
    "Strokes over bodies that are known exactly, at 0.1 m/s, with 30 frames and 1000 ticks per second; the "
    "truth is that of each tick.\n"
    "rms: of the law's force against an ideal constraint; JND: just noticeable differences; hand: JND after "
    "the blend.\n"
    "lost: contact ticks without force; along: error along the stroke; lag: of the proxy along it; stop, "
    "lag: "
    "strokes\n"
    "whose proxy stayed behind for good, or for a while; ghost: force on a HIP that touches nothing; wrong: "
    "force into the body;\n"
    "end: where contact ended beyond the end of the body, earliest and latest, and in pixel pitches.\n\n";

std::string endText(const EndSpread& end) {
  if (end.ends == 0) return "";
  return fmt::format(" {:+.1f} {:+.1f} mm {:.1f} px", 1000 * end.earliest_m, 1000 * end.latest_m,
                     end.worst_pitches);
}

Json spreadJson(const Spread& spread) {
  return {{"rms", spread.rms()}, {"max", spread.max()}};
}

}  // namespace

std::string strokesTable(const std::vector<StrokesRow>& rows) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{}", kExplanation);
  fmt::format_to(
      out,
      "law            scene         dist  noise     n | rms N   JND  hand | lost % | along max   rms "
      "|   lag limit stop lag | ghost N     % | wrong % | end\n");
  for (const StrokesRow& row : rows) {
    const StrokeFigures& f = row.figures;
    fmt::format_to(
        out,
        "{:<15}{:<13}{:>5.2f}  {:<8}{:>3} |{:>6.2f}{:>6.2f}{:>6.2f} |{:>7.2f} |{:>10.2f}{:>6.2f} "
        "|{:>6.1f}{:>6.1f}{:>5}{:>4} |{:>8.2f}{:>6.1f} |{:>8.2f} | {}{}{}\n",
        row.law, row.scene.name, row.distance_m, nameOf(row.noise), f.strokes, f.error.error_n.rms(),
        f.error.error_jnd.rms(), f.blended.error_jnd.rms(), f.lostPercent(), f.along_n.max(), f.along_n.rms(),
        1000 * f.lag_m, 1000 * row.lag_limit_m, f.stopped, f.lagged, f.ghost_n, f.ghostPercent(),
        f.wrongSidePercent(), row.variant, endText(f.end),
        f.outside_model_ticks > 0 ? fmt::format("  {} ticks outside the model", f.outside_model_ticks) : "");
  }
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
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
