// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/strokes/strokes_requirements.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <set>

#include "tools/hapticbench/accuracy/accuracy_study.h"

namespace hapticd::tools {
namespace {

constexpr double kNear_m = 1.2;
constexpr double kRounding = 1e-9;

bool isNoisy(const StrokesRow& row) {
  return row.noise > SceneNoise::quantised;
}

bool isResting(const StrokesRow& row) {
  return !row.scene.moving;
}

bool isSmooth(const StrokesRow& row) {
  return row.scene.smooth && isResting(row);
}

bool isNamed(const StrokesRow& row, const std::set<std::string>& names) {
  return names.contains(row.scene.name);
}

bool isRandom(const StrokesRow& row) {
  return isNamed(row, {kRandomNear, kRandomFar});
}

/// Its strokes have a true direction and size at each tick, not only a true side.
bool hasTrueForce(const StrokesRow& row) {
  return !row.scene.name.ends_with("_deep");
}

bool isCurved(const StrokesRow& row) {
  return isSmooth(row) && std::isfinite(row.scene.narrowest_m);
}

/// What a row shows of a bound, and what is allowed; nothing where the bound is not for it.
struct Figure {
  double value = 0;
  double allowed = 0;
};
struct Bound {
  const char* text;
  std::function<std::optional<Figure>(const StrokesRow&)> figure;
};

std::optional<Figure> figureIf(bool applies, double value, double allowed) {
  return applies ? std::optional(Figure{value, allowed}) : std::nullopt;
}

const std::vector<Bound>& bounds() {
  static const std::vector<Bound> all{
      {"strokes along smooth bodies that stop or lag: none",
       [](const StrokesRow& r) { return figureIf(isSmooth(r), r.figures.lagged, 0); }},
      {"force along the stroke, N: 0.2 without noise, and with it to 1.2 m",
       [](const StrokesRow& r) {
         return figureIf(isSmooth(r) && (!isNoisy(r) || r.distance_m <= kNear_m), r.figures.along_n.max(),
                         0.2);
       }},
      {"RMS force along the stroke over the floor of the tilt beyond 1.2 m: 1.3",
       [](const StrokesRow& r) {
         return figureIf(isSmooth(r) && isNoisy(r) && r.distance_m > kNear_m && r.alongByFloor(),
                         r.alongByFloor().value_or(0), 1.3);
       }},
      {"contact lost on flat surfaces, %: 0 to 2 m, 5 beyond",
       [](const StrokesRow& r) {
         return figureIf(isSmooth(r) && r.scene.flat, r.figures.lostPercent(), r.distance_m <= 2 ? 0 : 5);
       }},
      {"contact lost on rods and spheres, %: 5",
       [](const StrokesRow& r) { return figureIf(isCurved(r), r.figures.lostPercent(), 5); }},
      {"RMS error over the floor with noise, 0.6 to 2 m: 1.3",
       [](const StrokesRow& r) {
         const bool applies = isSmooth(r) && !isRandom(r) && hasTrueForce(r) && r.distance_m >= 0.6 &&
                              r.distance_m <= 2 && r.errorByFloor();
         return figureIf(applies, r.errorByFloor().value_or(0), 1.3);
       }},
      {"RMS error on flat surfaces with noise to 1.2 m, JND: 1",
       [](const StrokesRow& r) {
         return figureIf(isSmooth(r) && r.scene.flat && isNoisy(r) && r.distance_m <= kNear_m,
                         r.figures.error.error_jnd.rms(), 1);
       }},
      {"RMS error on surfaces that move at 0.1 and 0.3 m/s, to 1 m, JND: 1",
       [](const StrokesRow& r) {
         return figureIf(isNamed(r, {"moving0.1", "moving0.3"}) && r.distance_m <= 1,
                         r.figures.error.error_jnd.rms(), 1);
       }},
      {"RMS error in creases, at a cube's corner and on small spheres at 0.6 m without noise, JND: 1",
       [](const StrokesRow& r) {
         const bool applies =
             isNamed(r, {"inner_edge", "inner_corner", "cube_corner", "sphere50", "sphere100"}) &&
             r.noise == SceneNoise::none && r.distance_m == 0.6;
         return figureIf(applies, r.figures.error.error_jnd.rms(), 1);
       }},
      {"where contact ends at edges and corners, pixel pitches: 1 without noise, 3 with it",
       [](const StrokesRow& r) {
         return figureIf(r.figures.end.ends > 0, r.figures.end.worst_pitches, isNoisy(r) ? 3 : 1);
       }},
      {"force on a HIP that touches nothing, N: 0.1",
       [](const StrokesRow& r) { return figureIf(r.figures.free_ticks > 0, r.figures.ghost_n, 0.1); }},
      {"ticks with force into the body, %: 0",
       [](const StrokesRow& r) { return figureIf(hasTrueForce(r), r.figures.wrongSidePercent(), 0); }},
  };
  return all;
}

std::string rowText(const StrokesRow& row, double value) {
  return fmt::format("{:.3g} ({}{}{}, {:g} m, {})", value, row.scene.name, row.variant.empty() ? "" : " ",
                     row.variant, row.distance_m, nameOf(row.noise));
}

StrokesRequirement judge(const Bound& bound, const std::string& law, const std::vector<StrokesRow>& rows) {
  StrokesRequirement result{law, bound.text, 0, 0, ""};
  double worst = -1;
  for (const StrokesRow& row : rows) {
    const auto figure = row.law == law ? bound.figure(row) : std::nullopt;
    if (!figure) continue;
    ++result.rows;
    if (figure->value > figure->allowed + kRounding) ++result.violated;
    const double by_allowed = figure->value - figure->allowed;
    if (result.rows > 1 && by_allowed <= worst) continue;
    worst = by_allowed;
    result.worst = rowText(row, figure->value);
  }
  return result;
}

}  // namespace

std::vector<StrokesRequirement> strokesRequirements(const std::vector<StrokesRow>& rows) {
  std::vector<StrokesRequirement> results;
  for (const char* law : {"proxy", "surface", "auto"}) {
    for (const Bound& bound : bounds()) {
      StrokesRequirement one = judge(bound, law, rows);
      if (one.rows > 0) results.push_back(std::move(one));
    }
  }
  return results;
}

}  // namespace hapticd::tools
