// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/godobject/godobject.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/hapticbench/engine/study.h"
#include "tools/lib/truth/noise_floor.h"

namespace hapticd::tools {
namespace {

struct GodObjectOptions {
  std::vector<std::string> laws{"surface"};  ///< of kLawChoices
  std::vector<std::string> scenes;           ///< empty: all
  std::vector<double> distances_m{0.6, 1, 1.5, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::sensor, SceneNoise::harsh};
  int seeds = 6;   ///< of place, turn and noise, each for all strokes of a scene
  int random = 0;  ///< scenes made by chance, in place of those with a name
  std::uint32_t seed = 1;
};

/// The strokes of one scene at one distance with one noise and one law.
struct GodObjectRow {
  std::string law;
  std::string scene;
  SceneGroup kind = SceneGroup::other;
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
  GodObjectFigures figures;
};

/// Adds the strokes of a scene, placed and seen by `seed`, to the rows, which are one for each law.
void addScene(const GodObjectScene& scene, std::uint32_t seed, std::vector<GodObjectRow>& rows) {
  const double distance_m = rows.front().distance_m;
  const SceneNoise noise = rows.front().noise;
  std::vector<rt::LiveParameters> settings;
  for (const GodObjectRow& row : rows) settings.push_back(shippedParameters(row.law, distance_m));
  const std::vector<GodObjectFigures> figures = measureScene(scene, {distance_m, noise, seed}, settings);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].figures.add(figures[i]);
}

std::vector<GodObjectRow> rowsFor(const GodObjectScene& scene, double distance_m, SceneNoise noise,
                                  const GodObjectOptions& options) {
  std::vector<GodObjectRow> rows;
  for (const std::string& law : options.laws)
    rows.push_back({law, scene.name, scene.kind, distance_m, noise, {}});
  return rows;
}

std::vector<GodObjectRow> measureScenes(const GodObjectOptions& options) {
  const bool by_chance = options.random > 0;
  const std::vector<GodObjectScene>& scenes = by_chance ? randomScenes() : godObjectScenes();
  std::vector<GodObjectRow> all;
  for (std::size_t kind = 0; kind < scenes.size(); ++kind) {
    const GodObjectScene& scene = scenes[kind];
    const bool is_chosen =
        options.scenes.empty() || std::ranges::find(options.scenes, scene.name) != options.scenes.end();
    // random scenes are of all kinds in turn
    const int kinds = static_cast<int>(scenes.size());
    const int count =
        by_chance ? (options.random + kinds - 1 - static_cast<int>(kind)) / kinds : options.seeds;
    if (!is_chosen && !by_chance) continue;
    for (const double distance_m : options.distances_m) {
      if (scene.at_m != 0 && scene.at_m != distance_m) continue;
      showProgress(fmt::format("{} at {} m", scene.name, distance_m));
      for (const SceneNoise noise : options.noises) {
        std::vector<GodObjectRow> rows = rowsFor(scene, distance_m, noise, options);
        for (int i = 0; i < count; ++i) addScene(scene, options.seed + static_cast<std::uint32_t>(i), rows);
        all.insert(all.end(), rows.begin(), rows.end());
      }
    }
  }
  return all;
}

constexpr const char* kGodObjectExplanation =
    "Strokes at 0.1 m/s, 5 to 8 mm deep, over scenes that are known by their signed distance, with 30 "
    "frames\n"
    "and 1000 ticks per second; the truth is a god-object on that distance at each tick. Error of the law's\n"
    "force in newtons (RMS, 99 %) and RMS in just noticeable differences of 0.28 N; blended: JND after the\n"
    "blend; lost: share of the ticks with a true force above 0.5 N in which that of the law is below 0.1 N;\n"
    "aside: share in which it points more than 30 degrees from the true one; ghost: largest force on a HIP\n"
    "farther than 2 mm and a pixel from everything; step: largest change of the force in a tick beyond that\n"
    "of the spring alone, and that of the god-object; loop: most energy that a closed loop gave to the "
    "hand;\n"
    "unknown: ticks that do not count, because no camera could know what holds the hand.\n\n";

double jndOf(double error_n) {
  return error_n / kForceJnd_n;
}

Row cellsOf(const GodObjectRow& r) {
  const GodObjectFigures& f = r.figures;
  return {{"/law", "law", 0, r.law},
          {"/scene", "scene", 0, r.scene},
          {"/distance_m", "m", 2, r.distance_m},
          {"/noise", "noise", 0, nameOf(r.noise)},
          {"/strokes", "n", 0, f.strokes},
          {"/error_n/rms", "rms N", 3, f.error_n.rms()},
          {"/error_n/p99", "p99 N", 2, quantile({f.errors_n.begin(), f.errors_n.end()}, 0.99)},
          {"/error_n/max", "max N", 2, f.error_n.max()},
          {"/error_jnd", "JND", 2, jndOf(f.error_n.rms())},
          {"/blended_error_jnd", "blended", 2, jndOf(f.blended_n.rms())},
          {"/contact_ticks", "", 0, f.contact_ticks},
          {"/lost_percent", "lost %", 2, f.lostPercent()},
          {"/aside_percent", "aside %", 2, f.asidePercent()},
          {"/ghost_n", "ghost N", 2, f.ghost_n},
          {"/step_n", "step N", 2, f.step_n},
          {"/true_step_n", "true", 2, f.true_step_n},
          {"/loop_j", "loop mJ", 4, Figure::where(f.loops > 0, f.loop_j), 1000},
          {"/unknown_ticks", "unknown", 0, f.unknown_ticks}};
}

std::vector<Limit> limitsOf(const GodObjectRow& r) {
  const GodObjectFigures& f = r.figures;
  const bool is_random = r.kind == SceneGroup::random;
  const bool side = r.kind == SceneGroup::side;
  constexpr double kSmooth_n = 0.1;  // a god-object's own step, beyond which a scene is not smooth
  return {{"contact lost in inner edges, without and with noise, %", r.kind == SceneGroup::crease,
           f.lostPercent(), isSensorNoise(r.noise) ? 2.0 : 0.0},
          {"force on a HIP that touches nothing, N", !is_random, f.ghost_n, 0.1},
          {"change of the force in a tick beyond the spring's where the god-object has none, N",
           f.strokes > 0 && f.true_step_n < kSmooth_n, f.step_n, 0.5},
          {"force more than 30 degrees from the true one at sides, %", side, f.asidePercent(), 0},
          {"RMS error at sides, JND", side, jndOf(f.error_n.rms()), 2}};
}

std::vector<Requirement> requirementsOf(const std::vector<GodObjectRow>& rows,
                                        const std::vector<std::string>& laws) {
  std::vector<Requirement> requirements = checked(
      laws, rows, [](const GodObjectRow& r, const std::string& law) { return r.law == law; }, limitsOf,
      [](const GodObjectRow& r) {
        return fmt::format("{} {:g} m {}", r.scene, r.distance_m, nameOf(r.noise));
      });
  std::erase_if(requirements, [](const Requirement& requirement) { return requirement.cases == 0; });
  return requirements;
}

}  // namespace

StudyCommand godobjectCommand(CLI::App& app) {
  const auto options = std::make_shared<GodObjectOptions>();
  StudyCommand command(app, "godobject",
                       "strokes over scenes known by their signed distance, against a god-object on it");
  command.quick("one seed of an inner edge, a plate's side and a ball at 1 m without noise", [options] {
    options->scenes = {"ball50", "vee60", "plateside"};
    options->distances_m = {1};
    options->noises = {SceneNoise::none};
    options->seeds = 1;
  });
  command.names("--laws", options->laws, kLawChoices, "surface");
  command.names("--scenes", options->scenes, namesOf(godObjectScenes()), "all");
  command.numbers("--distances", options->distances_m, 0.45, 3.5, "from the camera, metres (0.6,1,1.5,2)");
  command.choices("--noises", options->noises, kAllNoises, "none,sensor,harsh");
  command.seed(options->seed, "the first one: of place, turn and noise (1)");
  command.number("--seeds", options->seeds, 1, 1000, "how many, each for all strokes of a scene (6)");
  command.number("--random", options->random, 0, 100000,
                 "that many scenes made by chance, in place of those with a name (0)");
  command.onReport([options] {
    const std::vector<GodObjectRow> rows = measureScenes(*options);
    Report report;
    report.say(kGodObjectExplanation);
    report.table("rows", "", rowsOf(rows, cellsOf));
    report.requirements(requirementsOf(rows, options->laws));
    return report;
  });
  return command;
}

}  // namespace hapticd::tools
