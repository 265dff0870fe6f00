// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
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

using Row = StrokesRow;

constexpr double kNear_m = 1.2;

constexpr const char* kExplanation =
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

Json ifEnded(const Row& row, Json figure) {
  return figureWhere(row.figures.end.ends > 0, std::move(figure));
}

Columns<Row> columns() {
  Columns<Row> list{{"/law", "law", 0, &Row::law},
                    {"/scene", "scene", 0, [](const Row& r) { return r.scene.name; }},
                    {"/distance_m", "m", 2, &Row::distance_m},
                    {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.noise); }},
                    {"/strokes", "n", 0, [](const Row& r) { return r.figures.strokes; }}};
  addSpread(list, "/error_n", "rms N", "", [](const Row& r) { return r.figures.error.error_n; });
  addSpread(list, "/error_jnd", "JND", "", [](const Row& r) { return r.figures.error.error_jnd; });
  addSpread(list, "/blended_error_jnd", "blended", "",
            [](const Row& r) { return r.figures.blended.error_jnd; });
  addSpread(list, "/along_n", "along N", "max", [](const Row& r) { return r.figures.along_n; });
  return joined<Row>(
      list,
      {{"/error_by_floor", "floor", 2, [](const Row& r) { return ifKnown(r.errorByFloor()); }},
       {"/along_by_floor", "along floor", 2, [](const Row& r) { return ifKnown(r.alongByFloor()); }},
       {"/contact_ticks", "", 0, [](const Row& r) { return r.figures.contact_ticks; }},
       {"/standard_error_n", "+- N", 3, [](const Row& r) { return ifKnown(r.standardError_n()); }},
       {"/lost_percent", "lost %", 2, [](const Row& r) { return r.figures.lostPercent(); }},
       {"/right_percent", "right %", 1, [](const Row& r) { return r.figures.rightPercent(); }},
       {"/size_ratio", "size", 2, [](const Row& r) { return ifKnown(r.figures.sizeRatio()); }},
       {"/delay_ms", "delay ms", 0,
        [](const Row& r) {
          const auto delay_ms = r.figures.delay.delay_ms();
          return figureWhere(delay_ms.has_value(), delay_ms.value_or(0));
        }},
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
        [](const Row& r) { return r.figures.outside_model_ticks; }}});
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

bool isFlat(const Row& row) {
  return isSmooth(row) && row.scene.flat;
}

bool isCurved(const Row& row) {
  return isSmooth(row) && std::isfinite(row.scene.narrowest_m);
}

/// A thinner body is measured, but not required: 12 pixels, which a rod of 20 mm spans at 1 m to a hundredth.
constexpr double kRequired_px = 11.8;

bool isThin(const Row& row) {
  return isCurved(row) && row.scene.spans_px(row.distance_m) < kRequired_px;
}

bool isRequiredCurved(const Row& row) {
  return isCurved(row) && !isThin(row);
}

bool isPlane(const Row& row) {
  return row.scene.name.starts_with("plane");
}

bool isOrgan(const Row& row) {
  return row.scene.moving && (row.scene.name.ends_with("_plane") || row.scene.name.ends_with("_ball"));
}

constexpr double kCurvedTo_m = 1.5;

const std::vector<RowRequirement<Row>>& rowRequirements() {
  static const std::vector<RowRequirement<Row>> all{
      {"strokes along smooth bodies that stop or lag",
       [](const Row& r) { return figureIf(isSmooth(r), r.figures.lagged, 0); }},
      {"RMS error on planes with noise, 1 to 3 m, times the floor of 160 mm",
       [](const Row& r) {
         const bool applies = isPlane(r) && r.distance_m >= 1 && r.distance_m <= 3 && r.errorByFloor();
         return figureIf(applies, r.errorByFloor().value_or(0), 1.3);
       }},
      {"RMS error on planes with noise at 0.6 m, JND",
       [](const Row& r) {
         return figureIf(isPlane(r) && isNoisy(r) && r.distance_m == 0.6, r.figures.error.error_jnd.rms(),
                         0.15);
       }},
      {"RMS error on flat surfaces with noise to 1.2 m, JND",
       [](const Row& r) {
         return figureIf(isFlat(r) && isNoisy(r) && r.distance_m <= kNear_m, r.figures.error.error_jnd.rms(),
                         1);
       }},
      {"force along the stroke on flat surfaces, with noise to 1.2 m, N",
       [](const Row& r) {
         return figureIf(isFlat(r) && (!isNoisy(r) || r.distance_m <= kNear_m), r.figures.along_n.max(), 0.2);
       }},
      {"RMS force along the stroke on flat surfaces beyond 1.2 m, times the floor of the tilt",
       [](const Row& r) {
         return figureIf(isFlat(r) && isNoisy(r) && r.distance_m > kNear_m && r.alongByFloor(),
                         r.alongByFloor().value_or(0), 1.3);
       }},
      {"contact lost on flat surfaces, to 2 m and beyond, %",
       [](const Row& r) { return figureIf(isFlat(r), r.figures.lostPercent(), r.distance_m <= 2 ? 0 : 5); }},
      {"RMS error on rods and balls of 12 px or more without noise, JND",
       [](const Row& r) {
         const bool applies = isRequiredCurved(r) && hasTrueForce(r) && !isNoisy(r);
         return figureIf(applies, r.figures.error.error_jnd.rms(), 0.3);
       }},
      {"force along the stroke there, N",
       [](const Row& r) {
         const bool applies = isRequiredCurved(r) && hasTrueForce(r) && !isNoisy(r);
         return figureIf(applies, r.figures.along_n.max(), 0.2);
       }},
      {"RMS error on rods and balls of 12 px or more with noise to 1.5 m, times the parametric bound",
       [](const Row& r) {
         const bool applies = isRequiredCurved(r) && r.distance_m <= kCurvedTo_m && r.errorByFloor();
         return figureIf(applies, r.errorByFloor().value_or(0), 2);
       }},
      {"contact lost on rods and balls of 12 px or more to 1.5 m, %",
       [](const Row& r) {
         const bool applies = isRequiredCurved(r) && hasTrueForce(r) && r.distance_m <= kCurvedTo_m;
         return figureIf(applies, r.figures.lostPercent(), 1);
       }},
      {"mean force at edges and corners at 2 m, off the true one by, share of it",
       [](const Row& r) {
         const bool applies =
             isNamed(r, {"ridge", "cube_corner", "inner_edge", "inner_corner"}) && r.distance_m == 2;
         return figureIf(applies, std::abs(r.figures.sizeRatio().value_or(0) - 1), 0.3);
       }},
      {"RMS error on surfaces that move at 0.1 and 0.3 m/s, to 1 m, JND",
       [](const Row& r) {
         return figureIf(isNamed(r, {"moving0.1", "moving0.3"}) && r.distance_m <= 1,
                         r.figures.error.error_jnd.rms(), 1);
       }},
      {"RMS error on surfaces that move like organs at 1 m, JND",
       [](const Row& r) {
         return figureIf(isOrgan(r) && r.distance_m == 1, r.figures.error.error_jnd.rms(), 1);
       }},
      {"RMS error in creases and at a cube's corner at 0.6 m without noise, JND",
       [](const Row& r) {
         const bool applies = isNamed(r, {"inner_edge", "inner_corner", "cube_corner"}) &&
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
  return fmt::format("{} {:g} m {}", row.scene.name, row.distance_m, nameOf(row.noise));
}

/// Names the thin bodies, which count for no requirement; empty where there are none.
std::string thinBodies(const std::vector<Row>& rows) {
  std::set<std::string> thin;
  for (const Row& row : rows) {
    if (!isThin(row)) continue;
    thin.insert(fmt::format("{} at {:g} m ({:.1f} px)", row.scene.name, row.distance_m,
                            row.scene.spans_px(row.distance_m)));
  }
  if (thin.empty()) return {};
  return fmt::format("\ntoo thin for the requirements on rods and balls: {}\n", fmt::join(thin, ", "));
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
  command->add_option("--seeds", options->seeds, "how many noises each stroke is seen with (10)")
      ->check(within(1, 1000));
  command->add_option("--variants", options->variants, "at most that many strokes over a scene; 0: all (0)")
      ->check(within(0, 1000));
  command.onRun([options](const StudyCommand& self) {
    const std::vector<StrokesRow> rows = measureStrokes(*options);
    Report report;
    report.say(kExplanation);
    report.table("rows", "", columns(), rows);
    report.say(thinBodies(rows));
    report.requirements(requirementsOf(rows));
    return self.report(report);
  });
  return command;
}

}  // namespace hapticd::tools
