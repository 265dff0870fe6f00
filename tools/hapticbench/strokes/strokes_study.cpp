// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/strokes/strokes_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>

#include "tools/lib/truth/fine_depth_model.h"
#include "tools/lib/truth/noise_floor.h"

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

JudgeLimits limitsOf(const rt::LiveParameters& setting, SceneNoise noise, double distance_m, double pitch_m) {
  // What the bounds allow a contact to end beside the true end of a body.
  const double pitches = noise == SceneNoise::none ? 1 : 3;
  constexpr double kClear_m = 0.002;
  return {.lag_m = std::max(0.005, 2 * pixelPitch_m(distance_m)),
          .end_m = pitches * pitch_m,
          .pitch_m = pitch_m,
          .clear_m = kClear_m + pitches * pixelPitch_m(distance_m) + noiseReach_m(noise, distance_m),
          .has_proxy = rt::hasProxy(setting.law)};
}

/// The row like `like`, which is made where there is none yet.
StrokesRow& rowOf(std::vector<StrokesRow>& rows, const StrokesRow& like) {
  const auto same = [&like](const StrokesRow& row) {
    return row.law == like.law && row.scene.name == like.scene.name && row.variant == like.variant &&
           row.distance_m == like.distance_m && row.noise == like.noise;
  };
  const auto found = std::ranges::find_if(rows, same);
  return found != rows.end() ? *found : rows.emplace_back(like);
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

/// Returns the share of an error in depth that is along the normal, in the middle of a stroke.
double depthToNormal(const StrokeCase& stroke) {
  const StrokePath& path = stroke.path;
  const double middle_m = path.length_m / 2;
  const Vec3 place = stroke.T_camera_bodies.positionOut(path.hip_m(middle_m));
  const Vec3 along = path.direction(middle_m);
  const Vec3 outward =
      path.bend_radius_m == 0 ? path.outward : unitOf(cross(along, cross(path.outward, along)));
  return std::abs(dot(stroke.T_camera_bodies.directionOut(outward), (1 / -place.z) * place));
}

/// The unavoidable error of a stroke: that of a patch that faces the camera and has as many pixels.
FloorError floorOf(const StrokeCase& stroke, SceneNoise noise, double distance_m, double stiffness_n_per_m) {
  const bool moving = !stroke.motion.rests();
  const double to_normal = depthToNormal(stroke);
  const FloorPatch patch{.side_m = stroke.patch_side_m * std::sqrt(to_normal),
                         .distance_m = distance_m,
                         .frames = moving ? 3 : 8,
                         .moving = moving,
                         .model = stroke.curved ? FloorModel::quadratic : FloorModel::plane};
  FloorError floor = noiseFloor(sensorParameters(noise), {}, patch, stiffness_n_per_m);
  floor.force_n *= to_normal;
  return floor;
}

/// One stroke and the rows to which it contributes.
class StrokeMeasurement {
 public:
  StrokeMeasurement(const StrokesOptions& options, std::vector<StrokesRow>& rows)
      : options_(options), rows_(rows) {}

  /// `like`: the rows but for the law.
  void measure(const StrokeCase& stroke, double distance_m, const StrokesRow& like, std::uint32_t seed) {
    std::vector<rt::LiveParameters> settings;
    for (const std::string& law : options_.laws) {
      settings.push_back(shippedParameters(law, distance_m));
      settings.back().camera.latency_s = options_.latency_ms / 1000;
    }
    const StrokeView view{.noise = like.noise,
                          .camera = like.noise == SceneNoise::none
                                        ? fineDepthModelAround(distance_m, stroke.beyond_m)
                                        : rt::DepthModelParameters{},
                          .latency_s = options_.latency_ms / 1000,
                          .seed = seed};
    const StrokeRun run = runStroke(stroke, view, settings);
    for (std::size_t i = 0; i < settings.size(); ++i) {
      StrokesRow one = like;
      one.law = options_.laws[i];
      const JudgeLimits limits = limitsOf(settings[i], like.noise, distance_m, run.pitch_m);
      StrokesRow& row = rowOf(rows_, one);
      row.lag_limit_m = limits.lag_m;
      add(row, judgeStroke(run.truth, run.output[i], limits), stroke, distance_m,
          settings[i].springs.stiffness_n_per_m);
    }
  }

 private:
  static void add(StrokesRow& row, const StrokeFigures& figures, const StrokeCase& stroke, double distance_m,
                  double stiffness_n_per_m) {
    row.figures.add(figures);
    if (!isSensorNoise(row.noise)) return;
    const FloorError floor = floorOf(stroke, row.noise, distance_m, stiffness_n_per_m);
    if (!floor.determined) return;
    row.floor_n.add(floor.force_n);
    row.tilt_floor_n.add(floor.tilt_force_n);
  }

  const StrokesOptions& options_;
  std::vector<StrokesRow>& rows_;
};

CasePlacement placementOf(const StrokesOptions& options, double distance_m, SceneNoise noise) {
  return {.distance_m = distance_m, .depth_m = options.depth_m, .dead_columns = isSensorNoise(noise)};
}

/// All strokes of one scene at one distance, as one camera sees them.
void measureScene(const StrokeScene& scene, double distance_m, SceneNoise noise,
                  const StrokesOptions& options, std::vector<StrokesRow>& rows) {
  StrokeMeasurement measurement(options, rows);
  std::mt19937 random(options.seed);
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (const StrokeCase& stroke :
         chosenCases(scene, placementOf(options, distance_m, noise), options, random)) {
      StrokesRow like;
      like.scene = scene;
      like.variant = options.each ? stroke.variant : "";
      like.distance_m = distance_m;
      like.noise = noise;
      measurement.measure(stroke, distance_m, like, static_cast<std::uint32_t>(random()));
    }
  }
}

bool isChosen(const StrokeScene& scene, const StrokesOptions& options) {
  return options.scenes.empty() || std::ranges::find(options.scenes, scene.name) != options.scenes.end();
}

}  // namespace

std::vector<StrokesRow> measureStrokes(const StrokesOptions& options,
                                       const std::function<void(const std::string&)>& progress) {
  std::vector<StrokesRow> rows;
  for (const StrokeScene& scene : strokeScenes()) {
    if (!isChosen(scene, options)) continue;
    for (const double distance_m : options.distances_m) {
      if (!isSeen(scene, distance_m)) continue;
      if (progress) progress(fmt::format("{} at {} m", scene.name, distance_m));
      for (const SceneNoise noise : options.noises) measureScene(scene, distance_m, noise, options, rows);
    }
  }
  return rows;
}

std::optional<double> StrokesRow::errorByFloor() const {
  if (floor_n.count() == 0) return std::nullopt;
  return figures.error.error_n.rms() / floor_n.rms();
}

std::optional<double> StrokesRow::alongByFloor() const {
  if (tilt_floor_n.count() == 0) return std::nullopt;
  return figures.along_n.rms() / tilt_floor_n.rms();
}

}  // namespace hapticd::tools
