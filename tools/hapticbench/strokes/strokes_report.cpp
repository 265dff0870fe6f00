// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/strokes/strokes_report.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

namespace hapticd::tools {
namespace {

using Row = StrokesRow;

constexpr double kNear_m = 1.2;

constexpr const char* kExplanation =
    "Strokes over bodies that are known exactly, at 0.1 m/s, with 30 frames and 1000 ticks per second;\n"
    "the truth is an ideal constraint without friction at the time of each tick. rms N, JND: error of the\n"
    "law's force, also in just noticeable differences; blended: JND after the blend; floor: the error\n"
    "over the least that the camera's noise allows; lost: share of the contact without force; along: the\n"
    "error along the stroke, newtons, and over the floor of the surface's tilt; lag: of the proxy along\n"
    "the stroke, its limit, and the strokes whose proxy stopped or lagged; ghost: force on a HIP that\n"
    "touches nothing, and share of the ticks above 0.1 N; wrong: share of the contact in which the force\n"
    "pointed into the body; end: where contact ended beyond the end of the body, earliest and latest, and\n"
    "in pixel pitches.\n\n";

Json ifKnown(const std::optional<double>& figure) {
  return figure ? Json(*figure) : Json();
}

Json ifEnded(const Row& row, Json figure) {
  return row.figures.end.ends > 0 ? std::move(figure) : noFigure();
}

std::vector<Column<Row>> makeColumns() {
  std::vector<Column<Row>> list{{"/law", "law", 0, &Row::law},
                                {"/scene", "scene", 0, [](const Row& r) { return r.scene.name; }},
                                {"/variant", "variant", 0, &Row::variant},
                                {"/distance_m", "m", 2, &Row::distance_m},
                                {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.noise); }},
                                {"/strokes", "n", 0, [](const Row& r) { return r.figures.strokes; }}};
  addSpread(list, "/error_n", "rms N", "", [](const Row& r) { return r.figures.error.error_n; });
  addSpread(list, "/error_jnd", "JND", "", [](const Row& r) { return r.figures.error.error_jnd; });
  addSpread(list, "/blended_error_jnd", "blended", "",
            [](const Row& r) { return r.figures.blended.error_jnd; });
  addSpread(list, "/normal_n", "", "", [](const Row& r) { return r.figures.normal_n; });
  addSpread(list, "/along_n", "along N", "max", [](const Row& r) { return r.figures.along_n; });
  const std::vector<Column<Row>> rest{
      {"/error_by_floor", "floor", 2, [](const Row& r) { return ifKnown(r.errorByFloor()); }},
      {"/along_by_floor", "along floor", 2, [](const Row& r) { return ifKnown(r.alongByFloor()); }},
      {"/contact_ticks", "", 0, [](const Row& r) { return r.figures.contact_ticks; }},
      {"/lost_percent", "lost %", 2, [](const Row& r) { return r.figures.lostPercent(); }},
      {"/lag_mm", "lag mm", 1, [](const Row& r) { return 1000 * r.figures.lag_m; }},
      {"/lag_limit_mm", "limit", 1, [](const Row& r) { return 1000 * r.lag_limit_m; }},
      {"/stopped", "stopped", 0, [](const Row& r) { return r.figures.stopped; }},
      {"/lagged", "lagged", 0, [](const Row& r) { return r.figures.lagged; }},
      {"/free_ticks", "", 0, [](const Row& r) { return r.figures.free_ticks; }},
      {"/ghost_n", "ghost N", 2, [](const Row& r) { return r.figures.ghost_n; }},
      {"/ghost_percent", "%", 1, [](const Row& r) { return r.figures.ghostPercent(); }},
      {"/wrong_side_percent", "wrong %", 2, [](const Row& r) { return r.figures.wrongSidePercent(); }},
      {"/end_mm/0", "end mm", 1, [](const Row& r) { return ifEnded(r, 1000 * r.figures.end.earliest_m); }},
      {"/end_mm/1", "to mm", 1, [](const Row& r) { return ifEnded(r, 1000 * r.figures.end.latest_m); }},
      {"/end_px", "px", 1, [](const Row& r) { return ifEnded(r, r.figures.end.worst_pitches); }},
      {"/ticks_outside_model", "not modelled", 0,
       [](const Row& r) { return r.figures.outside_model_ticks; }}};
  list.insert(list.end(), rest.begin(), rest.end());
  return list;
}

const std::vector<Column<Row>>& columns() {
  static const std::vector<Column<Row>> all = makeColumns();
  return all;
}

bool isNoisy(const Row& row) {
  return isSensorNoise(row.noise);
}

bool isResting(const Row& row) {
  return !row.scene.moving;
}

bool isSmooth(const Row& row) {
  return row.scene.smooth && isResting(row);
}

bool isNamed(const Row& row, const std::set<std::string>& names) {
  return names.contains(row.scene.name);
}

/// The true force is known at each tick, not only the side that it is on.
bool hasTrueForce(const Row& row) {
  return !row.scene.name.ends_with("_deep");
}

bool isCurved(const Row& row) {
  return isSmooth(row) && std::isfinite(row.scene.narrowest_m);
}

const std::vector<RowRequirement<Row>>& rowRequirements() {
  static const std::vector<RowRequirement<Row>> all{
      {"strokes along smooth bodies that stop or lag",
       [](const Row& r) { return figureIf(isSmooth(r), r.figures.lagged, 0); }},
      {"force along the stroke, with noise to 1.2 m, N",
       [](const Row& r) {
         return figureIf(isSmooth(r) && (!isNoisy(r) || r.distance_m <= kNear_m), r.figures.along_n.max(),
                         0.2);
       }},
      {"RMS force along the stroke beyond 1.2 m, times the floor of the tilt",
       [](const Row& r) {
         return figureIf(isSmooth(r) && isNoisy(r) && r.distance_m > kNear_m && r.alongByFloor(),
                         r.alongByFloor().value_or(0), 1.3);
       }},
      {"contact lost on flat surfaces, to 2 m and beyond, %",
       [](const Row& r) {
         return figureIf(isSmooth(r) && r.scene.flat, r.figures.lostPercent(), r.distance_m <= 2 ? 0 : 5);
       }},
      {"contact lost on rods and spheres, %",
       [](const Row& r) { return figureIf(isCurved(r), r.figures.lostPercent(), 5); }},
      {"RMS error with noise, 0.6 to 2 m, times the floor",
       [](const Row& r) {
         const bool applies =
             isSmooth(r) && hasTrueForce(r) && r.distance_m >= 0.6 && r.distance_m <= 2 && r.errorByFloor();
         return figureIf(applies, r.errorByFloor().value_or(0), 1.3);
       }},
      {"RMS error on flat surfaces with noise to 1.2 m, JND",
       [](const Row& r) {
         return figureIf(isSmooth(r) && r.scene.flat && isNoisy(r) && r.distance_m <= kNear_m,
                         r.figures.error.error_jnd.rms(), 1);
       }},
      {"RMS error on surfaces that move at 0.1 and 0.3 m/s, to 1 m, JND",
       [](const Row& r) {
         return figureIf(isNamed(r, {"moving0.1", "moving0.3"}) && r.distance_m <= 1,
                         r.figures.error.error_jnd.rms(), 1);
       }},
      {"RMS error in creases, at a cube's corner and on spheres at 0.6 m without noise, JND",
       [](const Row& r) {
         const bool applies =
             isNamed(r, {"inner_edge", "inner_corner", "cube_corner", "sphere50", "sphere100"}) &&
             r.noise == SceneNoise::none && r.distance_m == 0.6;
         return figureIf(applies, r.figures.error.error_jnd.rms(), 1);
       }},
      {"distance from the end of contact to the end of the body, pixel pitches",
       [](const Row& r) {
         return figureIf(r.figures.end.ends > 0, r.figures.end.worst_pitches, isNoisy(r) ? 3 : 1);
       }},
      {"force on a HIP that touches nothing, N",
       [](const Row& r) { return figureIf(r.figures.free_ticks > 0, r.figures.ghost_n, 0.1); }},
      {"ticks with force into the body, %",
       [](const Row& r) { return figureIf(hasTrueForce(r), r.figures.wrongSidePercent(), 0); }},
  };
  return all;
}

std::string describe(const Row& row) {
  return fmt::format("{} {:g} m {} {}", row.scene.name, row.distance_m, nameOf(row.noise), row.variant);
}

}  // namespace

std::vector<Requirement> requirementsOf(const std::vector<StrokesRow>& rows) {
  std::vector<Requirement> results;
  for (const std::string& law : kProxyLawChoices) {
    const auto of_law = [&law](const StrokesRow& row) { return row.law == law; };
    for (const RowRequirement<Row>& requirement : rowRequirements()) {
      Requirement result = checked(law, requirement, rows, of_law, describe);
      if (result.cases > 0) results.push_back(std::move(result));
    }
  }
  return results;
}

std::string strokesText(const std::vector<StrokesRow>& rows) {
  return kExplanation + tableText(columns(), rows) + requirementsText(requirementsOf(rows));
}

std::string strokesJson(const std::vector<StrokesRow>& rows) {
  const Json document{{"benchmark", "strokes"},
                      {"rows", tableJson(columns(), rows)},
                      {"requirements", requirementsJson(requirementsOf(rows))}};
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
