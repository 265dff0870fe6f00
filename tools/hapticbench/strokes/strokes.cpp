// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/strokes/strokes.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

double pixelPitch_m(double distance_m) {
  return distance_m / rt::DepthModelParameters{}.fx_px;
}

/// Returns how far in front of its position noise may show a surface: three standard deviations of a
/// measurement of 0.6 raw units, the harsher camera's.
double noiseReach_m(SceneNoise noise, double distance_m) {
  constexpr double kSigma_raw = 0.6;
  if (noise == SceneNoise::none) return 0;
  return 3 * kSigma_raw * -rt::DepthModelParameters{}.a_per_m * distance_m * distance_m;
}

JudgeLimits limitsOf(const StrokeCase& stroke, const rt::LiveParameters& setting, SceneNoise noise,
                     double distance_m, double pitch_m) {
  // What the bounds allow a contact to end beside the true end of a body.
  const double pitches = noise == SceneNoise::none ? 1 : 3;
  constexpr double kClear_m = 0.002;
  return {.lag_m = std::max(0.005, 2 * pixelPitch_m(distance_m)),
          .end_m = pitches * pitch_m,
          .pitch_m = pitch_m,
          .clear_m = kClear_m + pitches * pixelPitch_m(distance_m) + noiseReach_m(noise, distance_m),
          .has_proxy = rt::hasProxy(setting.law),
          .moving = !stroke.motion.rests() && stroke.hip == HipMotion::stays};
}

/// Returns the strokes of a scene, at most as many as requested.
std::vector<StrokeCase> chosenCases(const StrokeScene& scene, const CasePlacement& placement,
                                    const StrokesOptions& options, std::mt19937& random) {
  std::vector<StrokeCase> cases = strokeCases(scene, placement, random);
  if (options.variants <= 0 || options.variants >= static_cast<int>(cases.size())) return cases;
  std::ranges::shuffle(cases, random);
  cases.resize(static_cast<std::size_t>(options.variants));
  return cases;
}

/// Adds a stroke to the rows, which are one for each law, as one camera sees it with the noise of each seed.
void addStroke(const StrokeCase& stroke, const std::vector<std::uint32_t>& seeds,
               std::vector<StrokesRow>& rows) {
  const SceneNoise noise = rows.front().noise;
  const double distance_m = rows.front().distance_m;
  std::vector<rt::LiveParameters> settings;
  for (const StrokesRow& row : rows) settings.push_back(shippedParameters(row.law, distance_m));
  const rt::DepthModelParameters camera = noise == SceneNoise::none
                                              ? fineDepthModelAround(distance_m, stroke.beyond_m)
                                              : rt::DepthModelParameters{};
  const FloorError floor =
      isSensorNoise(noise) ? strokeFloor(stroke, noise, distance_m, settings.front().force.stiffness_n_per_m)
                           : FloorError{};
  for (std::size_t seed = 0; seed < seeds.size(); ++seed) {
    const StrokeRun run = runStroke(stroke, {noise, camera, seeds[seed]}, settings);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      StrokesRow& row = rows[i];
      const JudgeLimits limits = limitsOf(stroke, settings[i], noise, distance_m, run.pitch_m);
      const StrokeFigures figures = judgeStroke(run.truth, run.output[i], limits);
      row.lag_limit_m = limits.lag_m;
      row.figures.add(figures);
      row.error_of_seed_n.resize(seeds.size());
      row.error_of_seed_n[seed].add(figures.error.error_n);
      if (!floor.determined) continue;
      row.floor_n.add(floor.force_n);
      row.tilt_floor_n.add(floor.tilt_force_n);
    }
  }
}

/// All strokes of one scene at one distance, as one camera sees them.
std::vector<StrokesRow> measureScene(const StrokeScene& scene, double distance_m, SceneNoise noise,
                                     const StrokesOptions& options) {
  std::vector<StrokesRow> rows(options.laws.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].law = options.laws[i];
    rows[i].scene = scene;
    rows[i].distance_m = distance_m;
    rows[i].noise = noise;
  }
  std::mt19937 random(options.seed);
  const CasePlacement placement{.distance_m = distance_m, .dead_columns = isSensorNoise(noise)};
  const std::vector<StrokeCase> cases = chosenCases(scene, placement, options, random);
  std::vector<std::uint32_t> seeds(isSensorNoise(noise) ? static_cast<std::size_t>(options.seeds) : 1);
  for (const StrokeCase& stroke : cases) {
    for (std::uint32_t& seed : seeds) seed = static_cast<std::uint32_t>(random());
    addStroke(stroke, seeds, rows);
  }
  return rows;
}

bool isChosen(const StrokeScene& scene, const StrokesOptions& options) {
  return options.scenes.empty() || std::ranges::find(options.scenes, scene.name) != options.scenes.end();
}

}  // namespace

std::vector<StrokesRow> measureStrokes(const StrokesOptions& options) {
  std::vector<StrokesRow> rows;
  for (const StrokeScene& scene : strokeScenes()) {
    if (!isChosen(scene, options)) continue;
    for (const double distance_m : options.distances_m) {
      if (!isSeen(scene, distance_m)) continue;
      showProgress(fmt::format("{} at {} m", scene.name, distance_m));
      for (const SceneNoise noise : options.noises) {
        const std::vector<StrokesRow> of_laws = measureScene(scene, distance_m, noise, options);
        rows.insert(rows.end(), of_laws.begin(), of_laws.end());
      }
    }
  }
  return rows;
}

std::optional<double> StrokesRow::errorByFloor() const {
  if (floor_n.count() == 0) return std::nullopt;
  return figures.error.error_n.rms() / floor_n.rms();
}

std::optional<double> StrokesRow::alongByFloor() const {
  if (tilt_floor_n.rms() == 0 || figures.along_n.max() == 0) return std::nullopt;  // no stroke
  return figures.along_n.rms() / tilt_floor_n.rms();
}

std::optional<double> StrokesRow::standardError_n() const {
  const auto seeds = static_cast<double>(error_of_seed_n.size());
  if (seeds < 2) return std::nullopt;
  double sum = 0;
  double squares = 0;
  for (const Spread& error_n : error_of_seed_n) {
    sum += error_n.rms();
    squares += error_n.rms() * error_n.rms();
  }
  const double variance = std::max(0.0, squares - sum * sum / seeds) / (seeds - 1);
  return std::sqrt(variance / seeds);
}

namespace {

constexpr const char* kStrokesExplanation =
    "Strokes over bodies that are known exactly, at 0.1 m/s, with 30 frames and 1000 ticks per second;\n"
    "the truth is an ideal constraint without friction at the time of each tick. rms N, JND: error of the\n"
    "law's force, also in just noticeable differences; blended: JND after the blend; floor: the error\n"
    "over the least that the camera's noise allows; lost: share of the contact without force; along: the\n"
    "error along the stroke, newtons, and over the floor of the surface's tilt; right: share of the contact\n"
    "within 30 degrees of the true force and within 0.5 N or 1 JND of its size; size: mean magnitude over "
    "the\n"
    "true one; delay: what the force comes later than the true one, by the shift of the least error; lag: of "
    "the proxy along\n"
    "the stroke, its limit, and the strokes whose proxy stopped or lagged; ghost: force on a HIP that\n"
    "touches nothing, and share of the ticks above 0.1 N; wrong: share of the contact in which the force\n"
    "pointed into the body; end: where contact ended beyond the end of the body, earliest and latest, and\n"
    "in pixel pitches.\n\n";

Row strokeCells(const StrokesRow& r) {
  const StrokeFigures& f = r.figures;
  const auto if_ended = [&f](double figure) { return Figure::where(f.end.ends > 0, figure); };
  const auto delay_ms = f.delay.delay_ms();
  Row row{{"/law", "law", 0, r.law},
          {"/scene", "scene", 0, r.scene.name},
          {"/distance_m", "m", 2, r.distance_m},
          {"/noise", "noise", 0, nameOf(r.noise)},
          {"/strokes", "n", 0, f.strokes}};
  for (const Row& spread : {spreadCells("/error_n", "rms N", "", f.error.error_n),
                            spreadCells("/error_jnd", "JND", "", f.error.error_jnd),
                            spreadCells("/blended_error_jnd", "blended", "", f.blended.error_jnd),
                            spreadCells("/along_n", "along N", "max", f.along_n)})
    row = joined(std::move(row), spread);
  return joined(std::move(row),
                {{"/error_by_floor", "floor", 2, r.errorByFloor()},
                 {"/along_by_floor", "along floor", 2, r.alongByFloor()},
                 {"/contact_ticks", "", 0, f.contact_ticks},
                 {"/standard_error_n", "+- N", 3, r.standardError_n()},
                 {"/lost_percent", "lost %", 2, f.lostPercent()},
                 {"/right_percent", "right %", 1, f.rightPercent()},
                 {"/size_ratio", "size", 2, f.sizeRatio()},
                 {"/delay_ms", "delay ms", 0, Figure::where(delay_ms.has_value(), delay_ms.value_or(0))},
                 {"/lag_mm", "lag mm", 1, 1000 * f.lag_m},
                 {"/lag_limit_mm", "limit", 1, 1000 * r.lag_limit_m},
                 {"/stopped", "stopped", 0, f.stopped},
                 {"/lagged", "lagged", 0, f.lagged},
                 {"/free_ticks", "", 0, f.free_ticks},
                 {"/ghost_n", "ghost N", 2, f.ghost_n},
                 {"/ghost_percent", "%", 1, f.ghostPercent()},
                 {"/wrong_side_percent", "wrong %", 2, f.wrongSidePercent()},
                 {"/end_mm/0", "end mm", 1, if_ended(1000 * f.end.earliest_m)},
                 {"/end_mm/1", "to mm", 1, if_ended(1000 * f.end.latest_m)},
                 {"/end_px", "px", 1, if_ended(f.end.worst_pitches)},
                 {"/ticks_outside_model", "not modelled", 0, f.outside_model_ticks}});
}

/// A thinner body is measured, but not required: 12 pixels, which a rod of 20 mm spans at 1 m to a hundredth.
constexpr double kRequired_px = 11.8;

bool isCurved(const StrokesRow& r) {
  return r.scene.smooth && !r.scene.moving && std::isfinite(r.scene.narrowest_m);
}

bool isThin(const StrokesRow& r) {
  return isCurved(r) && r.scene.spans_px(r.distance_m) < kRequired_px;
}

std::vector<Limit> strokeLimits(const StrokesRow& r) {
  constexpr double kNear_m = 1.2;
  constexpr double kCurvedTo_m = 1.5;
  const StrokeFigures& f = r.figures;
  const std::string& name = r.scene.name;
  const double m = r.distance_m;
  const auto is_named = [&name](const std::set<std::string>& names) { return names.contains(name); };
  const bool noisy = isSensorNoise(r.noise);
  const bool smooth = r.scene.smooth && !r.scene.moving;
  const bool flat = smooth && r.scene.flat;
  const bool plane = name.starts_with("plane");
  const bool curved = isCurved(r) && !isThin(r);
  // the true force is known at each tick, not only the side that it is on
  const bool true_force = !name.ends_with("_deep");
  const bool organ = r.scene.moving && (name.ends_with("_plane") || name.ends_with("_ball"));
  const double rms_jnd = f.error.error_jnd.rms();
  const auto by_floor = r.errorByFloor();
  const auto along_by_floor = r.alongByFloor();
  return {{"strokes along smooth bodies that stop or lag", smooth, static_cast<double>(f.lagged), 0},
          {"RMS error on planes with noise, 1 to 3 m, times the floor of 160 mm",
           plane && m >= 1 && m <= 3 && by_floor, by_floor.value_or(0), 1.3},
          {"RMS error on planes with noise at 0.6 m, JND", plane && noisy && m == 0.6, rms_jnd, 0.15},
          {"RMS error on flat surfaces with noise to 1.2 m, JND", flat && noisy && m <= kNear_m, rms_jnd, 1},
          {"force along the stroke on flat surfaces, with noise to 1.2 m, N",
           flat && (!noisy || m <= kNear_m), f.along_n.max(), 0.2},
          {"RMS force along the stroke on flat surfaces beyond 1.2 m, times the floor of the tilt",
           flat && noisy && m > kNear_m && along_by_floor, along_by_floor.value_or(0), 1.3},
          {"contact lost on flat surfaces, to 2 m and beyond, %", flat, f.lostPercent(), m <= 2 ? 0.0 : 5.0},
          {"RMS error on rods and balls of 12 px or more without noise, JND", curved && true_force && !noisy,
           rms_jnd, 0.3},
          {"force along the stroke there, N", curved && true_force && !noisy, f.along_n.max(), 0.2},
          {"RMS error on rods and balls of 12 px or more with noise to 1.5 m, times the parametric bound",
           curved && m <= kCurvedTo_m && by_floor, by_floor.value_or(0), 2},
          {"contact lost on rods and balls of 12 px or more to 1.5 m, %",
           curved && true_force && m <= kCurvedTo_m, f.lostPercent(), 1},
          {"mean force at edges and corners at 2 m, off the true one by, share of it",
           is_named({"ridge", "cube_corner", "inner_edge", "inner_corner"}) && m == 2,
           std::abs(f.sizeRatio().value_or(0) - 1), 0.3},
          {"RMS error on surfaces that move at 0.1 and 0.3 m/s, to 1 m, JND",
           is_named({"moving0.1", "moving0.3"}) && m <= 1, rms_jnd, 1},
          {"RMS error on surfaces that move like organs at 1 m, JND", organ && m == 1, rms_jnd, 1},
          {"RMS error in creases and at a cube's corner at 0.6 m without noise, JND",
           is_named({"inner_edge", "inner_corner", "cube_corner"}) && r.noise == SceneNoise::none && m == 0.6,
           rms_jnd, 1},
          {"distance from the end of contact to the end of the body, pixel pitches", f.end.ends > 0,
           f.end.worst_pitches, noisy ? 3.0 : 1.0},
          {"force on a HIP that touches nothing, N", f.free_ticks > 0, f.ghost_n, 0.1},
          {"ticks with force into the body, %", true_force, f.wrongSidePercent(), 0}};
}

/// Names the thin bodies, which count for no requirement; empty where there are none.
std::string thinBodies(const std::vector<StrokesRow>& rows) {
  std::set<std::string> thin;
  for (const StrokesRow& row : rows) {
    if (!isThin(row)) continue;
    thin.insert(fmt::format("{} at {:g} m ({:.1f} px)", row.scene.name, row.distance_m,
                            row.scene.spans_px(row.distance_m)));
  }
  if (thin.empty()) return {};
  return fmt::format("\ntoo thin for the requirements on rods and balls: {}\n", fmt::join(thin, ", "));
}

}  // namespace

std::vector<Requirement> requirementsOf(const std::vector<StrokesRow>& rows) {
  std::vector<Requirement> requirements = checked(
      kProxyLawChoices, rows, [](const StrokesRow& r, const std::string& law) { return r.law == law; },
      strokeLimits,
      [](const StrokesRow& r) {
        return fmt::format("{} {:g} m {}", r.scene.name, r.distance_m, nameOf(r.noise));
      });
  std::erase_if(requirements, [](const Requirement& requirement) { return requirement.cases == 0; });
  return requirements;
}

StudyCommand strokesCommand(CLI::App& app) {
  const auto options = std::make_shared<StrokesOptions>();
  StudyCommand command(app, "strokes",
                       "strokes over known bodies: error, lost contact, lag, forces that nothing explains");
  command.quick("one stroke each over a plane, a rod and an edge at 1 m", [options] {
    options->scenes = {"plane0", "rod40", "over_edge"};
    options->distances_m = {1};
    options->variants = 1;
    options->seeds = 1;
  });
  command.names("--laws", options->laws, kLawChoices, "proxy,surface,auto");
  command.names("--scenes", options->scenes, namesOf(strokeScenes()), "all");
  command.numbers("--distances", options->distances_m, 0.45, 3.5, "from the camera, metres (0.6,1,1.5,2,3)");
  command.choices("--noises", options->noises, kAllNoises, "none,sensor,harsh");
  command.seed(options->seed, "of the positions and of the noise (1)");
  command.number("--seeds", options->seeds, 1, 1000, "how many noises each stroke is seen with (10)");
  command.number("--variants", options->variants, 0, 1000,
                 "at most that many strokes over a scene; 0: all (0)");
  command.onReport([options] {
    const std::vector<StrokesRow> rows = measureStrokes(*options);
    Report report;
    report.say(kStrokesExplanation);
    report.table("rows", "", rowsOf(rows, strokeCells));
    report.say(thinBodies(rows));
    report.requirements(requirementsOf(rows));
    return report;
  });
  return command;
}

}  // namespace hapticd::tools
