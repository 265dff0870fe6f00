#include "tools/hapticbench/strokes/strokes_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "config/law_choice.h"
#include "config/settings.h"
#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/truth/fine_depth_model.h"

namespace hapticd::tools {
namespace {

double pixelPitch_m(double distance_m) {
  return distance_m / rt::DepthModelParameters{}.fx_px;
}

/// With noise a surface may be felt that far in front of where it is: three standard deviations of a
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

/// The row of that law and variant, which is made where there is none yet.
StrokesRow& rowOf(std::vector<StrokesRow>& rows, const StrokesRow& like) {
  const auto same = [&like](const StrokesRow& row) {
    return row.law == like.law && row.scene.name == like.scene.name && row.variant == like.variant &&
           row.distance_m == like.distance_m && row.noise == like.noise;
  };
  const auto found = std::ranges::find_if(rows, same);
  return found != rows.end() ? *found : rows.emplace_back(like);
}

/// The strokes of a scene, all of them or as many as are wanted.
std::vector<StrokeCase> chosenCases(const StrokeScene& scene, const CasePlacement& placement,
                                    const StrokesOptions& options, std::mt19937& random) {
  std::vector<StrokeCase> cases = strokeCases(scene, placement, random);
  if (options.variants <= 0 || options.variants >= static_cast<int>(cases.size())) return cases;
  std::ranges::shuffle(cases, random);
  cases.resize(static_cast<std::size_t>(options.variants));
  return cases;
}

/// All strokes of one scene at one distance, as one camera sees them.
void measureScene(const StrokeScene& scene, double distance_m, SceneNoise noise,
                  const StrokesOptions& options, std::vector<StrokesRow>& rows) {
  std::vector<rt::LiveParameters> settings;
  for (const std::string& law : options.laws) settings.push_back(strokeSetting(law, distance_m));
  const CasePlacement placement{
      .distance_m = distance_m, .depth_m = options.depth_m, .dead_columns = noise > SceneNoise::quantised};
  std::mt19937 random(options.seed);
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (const StrokeCase& stroke : chosenCases(scene, placement, options, random)) {
      const StrokeView view{.noise = noise,
                            .camera = noise == SceneNoise::none
                                          ? fineDepthModelAround(distance_m, stroke.beyond_m)
                                          : rt::DepthModelParameters{},
                            .latency_s = options.latency_s,
                            .seed = static_cast<std::uint32_t>(random())};
      const StrokeRun run = runStroke(stroke, view, settings);
      for (std::size_t i = 0; i < settings.size(); ++i) {
        const JudgeLimits limits = limitsOf(settings[i], noise, distance_m, run.pitch_m);
        const StrokesRow like{
            options.laws[i], scene, options.each ? stroke.variant : "", distance_m, noise, {}, limits.lag_m};
        rowOf(rows, like).figures.add(judgeStroke(run.truth, run.felt[i], limits));
      }
    }
  }
}

bool isChosen(const StrokeScene& scene, const StrokesOptions& options) {
  return options.scenes.empty() || std::ranges::find(options.scenes, scene.name) != options.scenes.end();
}

}  // namespace

const std::vector<std::string>& strokeLaws() {
  static const std::vector<std::string> laws{"nearest_springs", "smooth_springs", "proxy", "surface", "auto"};
  return laws;
}

rt::LiveParameters strokeSetting(const std::string& law, double distance_m) {
  const config::Settings shipped;
  if (law == "auto") {
    const double allowed_n = shipped.force.effectiveMaxError_n(shipped.live.safety);
    return config::liveWith(shipped, config::chooseLaw(allowed_n, shipped.live.springs.stiffness_n_per_m,
                                                       config::distanceClass_m(distance_m, 0)));
  }
  rt::LiveParameters live = shipped.live;
  for (const rt::ForceLaw one : kAllLaws) {
    if (nameOf(one) == law) live.law = one;
  }
  return live;
}

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

}  // namespace hapticd::tools
