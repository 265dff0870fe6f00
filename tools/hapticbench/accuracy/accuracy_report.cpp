// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/accuracy_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/hapticbench/accuracy/accuracy_summary.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kExplanation =
    "surface: error of the force against a spring of k_s = 500 N/m from the HIP to an ideal constraint on "
    "the true\n"
    "  surface, 5 to 20 mm behind it. law: against the law itself in double precision: the springs on the "
    "surface\n"
    "  without noise (also 5 to 20 mm in front of it), proxy on the closest point of the filtered image; "
    "none for\n"
    "  the law surface, which fits planes to many pixels of many frames.\n"
    "  rms and max in N, % of the true force, multiples of the just noticeable difference max(7 % of F, 0.1 "
    "N).\n"
    "proxy: its distance from the true surface (less the ball's radius for the law proxy).\n"
    "pop: smallest force over the pushes at which the surface gave way, or the largest reached (the push "
    "ends 45 mm\n"
    "  deep, or where a body lets an ideal constraint go), the HIP's depth there, and how many pushes "
    "popped\n"
    "  through under 3, 10 and 20 N. drop: how far the force fell back while a surface came nearer.\n"
    "step: largest change at a new frame with the HIP held still 10 mm behind the surface (springs: in "
    "front), of\n"
    "  the law and of the blended command in that tick; slew: of the command at any tick.\n";

void addErrorHeads(fmt::memory_buffer& text, const char* first) {
  fmt::format_to(std::back_inserter(text),
                 "{} |{:>8}{:>8}{:>8}{:>7}{:>7}{:>7}{:>7} |{:>8}{:>8}{:>6} |{:>6}{:>6} |{:>7}{:>7}{:>10} "
                 "|{:>6} |{:>6}{:>6}{:>8}\n",
                 first, "rms N", "max N", "rms %", "JND", "maxJND", "deg", "maxdeg", "law rms", "max N",
                 "deg", "prox", "mm max", "pop N", "at mm", "3/10/20 dip of", "drop", "step N", "blend",
                 "slew N/s");
}

template <typename Result>
void addFigures(fmt::memory_buffer& text, const Result& r) {
  const ForceErrors& s = r.against_surface;
  const ForceErrors& l = r.against_law;
  const PopThroughs& p = r.pops;
  fmt::format_to(std::back_inserter(text),
                 " |{:>8.3f}{:>8.3f}{:>8.2f}{:>7.2f}{:>7.2f}{:>7.2f}{:>7.2f} |{:>8.3f}{:>8.3f}{:>6.2f} "
                 "|{:>6.2f}{:>6.2f} |{:>7.2f}{:>7.1f}{:>15} |{:>6.2f} |{:>6.2f}{:>6.2f}{:>8.1f}{}\n",
                 s.error_n.rms(), s.error_n.max(), s.error_percent.rms(), s.error_jnd.rms(),
                 s.error_jnd.max(), s.direction_deg.rms(), s.direction_deg.max(), l.error_n.rms(),
                 l.error_n.max(), l.direction_deg.rms(), r.proxy_to_surface_mm.rms(),
                 r.proxy_to_surface_mm.max(), p.least_force_n, p.depth_at_least_force_mm,
                 fmt::format("{}/{}/{} {} {}", p.popped_under[0], p.popped_under[1], p.popped_under[2],
                             p.dipped, p.pushes),
                 r.largest_drop_n, r.law_step_n, r.blended_step_n, r.slew_n_per_s,
                 r.outside_model > 0 ? fmt::format("  {} ticks outside the model", r.outside_model) : "");
}

void addRows(fmt::memory_buffer& text, rt::ForceLaw law, const std::vector<AccuracyRow>& rows) {
  const auto of_law = [law](const AccuracyRow& row) { return row.law == law && row.pops.pushes > 0; };
  if (std::none_of(rows.begin(), rows.end(), of_law)) return;
  fmt::format_to(std::back_inserter(text), "\n{}\n", nameOf(law));
  addErrorHeads(text, "scene         dist m  noise  filter");
  for (const AccuracyRow& row : rows) {
    if (!of_law(row)) continue;
    fmt::format_to(std::back_inserter(text), "{:<14}{:>6.1f}  {:<7}{:<6}", row.scene, row.distance_m,
                   nameOf(row.noise), row.filtered ? "on" : "off");
    addFigures(text, row);
  }
}

void addSummary(fmt::memory_buffer& text, const std::vector<AccuracyRow>& rows) {
  fmt::format_to(std::back_inserter(text), "\nall scenes and distances together\n");
  addErrorHeads(text, "law               noise  filter    ");
  for (const AccuracySummary& summary : summaryOf(rows)) {
    fmt::format_to(std::back_inserter(text), "{:<18}{:<7}{:<10}", nameOf(summary.law), nameOf(summary.noise),
                   summary.filtered ? "on" : "off");
    addFigures(text, summary);
  }
}

void addRequirements(fmt::memory_buffer& text, const std::vector<AccuracyRow>& rows) {
  constexpr std::size_t kShown = 12;
  fmt::format_to(std::back_inserter(text), "\nwhat must hold\n");
  for (const Requirement& requirement : requirementsOf(rows)) {
    const char* verdict = requirement.rows == 0            ? "not measured"
                          : requirement.violations.empty() ? "holds"
                                                           : "VIOLATED";
    fmt::format_to(std::back_inserter(text), "{:<13}{} ({} of {} cases)\n", verdict, requirement.text,
                   requirement.rows - requirement.violations.size(), requirement.rows);
    for (std::size_t i = 0; i < std::min(kShown, requirement.violations.size()); ++i) {
      fmt::format_to(std::back_inserter(text), "    {}\n", requirement.violations[i]);
    }
    if (requirement.violations.size() > kShown) {
      fmt::format_to(std::back_inserter(text), "    and {} more\n", requirement.violations.size() - kShown);
    }
  }
}

Json spreadOf(const Spread& spread) {
  return {{"rms", spread.rms()}, {"max", spread.max()}};
}

Json errorsOf(const ForceErrors& errors) {
  return {{"samples", errors.error_n.count()},
          {"error_n", spreadOf(errors.error_n)},
          {"error_percent", spreadOf(errors.error_percent)},
          {"error_jnd", spreadOf(errors.error_jnd)},
          {"direction_deg", spreadOf(errors.direction_deg)}};
}

/// What rows and summaries have in common.
template <typename Result>
void addCommon(Json& json, const Result& r) {
  json["law"] = nameOf(r.law);
  json["noise"] = nameOf(r.noise);
  json["filtered"] = r.filtered;
  json["against_surface"] = errorsOf(r.against_surface);
  json["against_law"] = errorsOf(r.against_law);
  if (rt::hasProxy(r.law)) json["proxy_to_surface_mm"] = spreadOf(r.proxy_to_surface_mm);
  json["pushes"] = r.pops.pushes;
  json["popped"] = r.pops.popped;
  json["slid_around"] = r.pops.around;
  json["dipped"] = r.pops.dipped;
  for (std::size_t i = 0; i < kPopLimits_n.size(); ++i) {
    json[fmt::format("popped_under_{:.0f}_n", kPopLimits_n[i])] = r.pops.popped_under[i];
  }
  json["pop_through_n"] = r.pops.least_force_n;
  json["depth_at_pop_through_mm"] = r.pops.depth_at_least_force_mm;
  json["largest_drop_n"] = r.largest_drop_n;
  json["law_step_n"] = r.law_step_n;
  json["blended_step_n"] = r.blended_step_n;
  json["slew_n_per_s"] = r.slew_n_per_s;
  json["ticks_outside_model"] = r.outside_model;
}

}  // namespace

std::string accuracyTable(const std::vector<AccuracyRow>& rows) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "{}", kExplanation);
  for (const rt::ForceLaw law : kAllLaws) addRows(text, law, rows);
  addSummary(text, rows);
  addRequirements(text, rows);
  return fmt::to_string(text);
}

std::string accuracyJson(const std::vector<AccuracyRow>& rows) {
  Json document{{"benchmark", "accuracy"}};
  Json& list = document["rows"] = Json::array();
  for (const AccuracyRow& row : rows) {
    Json json{{"scene", row.scene}, {"distance_m", row.distance_m}};
    if (row.grid_difference_n >= 0) {
      json["law"] = nameOf(row.law);
      json["noise"] = nameOf(row.noise);
      json["voxel_edge_m"] = row.voxel_edge_m;
      json["grid_difference_n"] = row.grid_difference_n;
    } else {
      addCommon(json, row);
    }
    list.push_back(json);
  }
  Json& summaries = document["summary"] = Json::array();
  for (const AccuracySummary& summary : summaryOf(rows))
    addCommon(summaries.emplace_back(Json::object()), summary);
  Json& requirements = document["requirements"] = Json::array();
  for (const Requirement& requirement : requirementsOf(rows)) {
    requirements.push_back(
        {{"text", requirement.text}, {"cases", requirement.rows}, {"violations", requirement.violations}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
