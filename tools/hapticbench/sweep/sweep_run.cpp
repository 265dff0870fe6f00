// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_run.h"

#include <array>
#include <limits>

#include "tools/hapticbench/stability/sampled_theory.h"

namespace hapticd::tools {

SweepGrid gridOf(const SweepSettings& settings) {
  return settings.quick ? SweepGrid::quick() : SweepGrid{};
}

bool sameButTime(const SweepResult& a, const SweepResult& b) {
  const auto numbers = [](const SweepResult& r) {
    return std::array{r.feel.felt_stiffness_n_per_m,
                      r.feel.steepest_stiffness_n_per_m,
                      r.feel.pop_through_n,
                      r.feel.edge_radius_m,
                      r.feel.smallest_ridge_m,
                      r.feel.stroke_h_m,
                      r.noise.median_n,
                      r.noise.largest_n,
                      r.stability_margin};
  };
  return a.point.index == b.point.index && numbers(a) == numbers(b) && a.noise.sites == b.noise.sites &&
         a.feel.edge_is_outside == b.feel.edge_is_outside;
}

rt::LiveParameters parametersOf(const SweepPoint& point) {
  rt::LiveParameters parameters;
  parameters.law = point.law;
  parameters.springs = point.springs;
  return parameters;
}

rt::FilterParameters sweepFilter() {
  return {.temporal_frames = 8, .hold_frames = 3, .spatial_radius_px = 2};
}

BenchSequence syntheticSequence(std::size_t frames) {
  TrueScene scene({.kind = SceneKind::plane, .distance_m = 1.2, .tilt_rad = 0.3});
  BenchSequence sequence{"synthetic", {}};
  for (std::size_t i = 0; i < frames; ++i) {
    sequence.frames.push_back(std::make_unique<rt::DepthFrame>());
    scene.render(0, i + 1, SceneNoise::sensor, *sequence.frames.back());
  }
  return sequence;
}

std::vector<SweepResult> runSweep(const SweepSettings& settings, const Shard& shard, const NoiseProbe& noise,
                                  const std::function<void(std::size_t, std::size_t)>& progress) {
  const DeviceAndHand light{.hand_stiffness_n_per_m = 400, .hand_damping_n_s_per_m = 4};
  const double limit_n_per_m = eigenvalueLimit_n_per_m(light, {.delay_ticks = settings.delay_ticks});
  std::vector<SweepPoint> points = pointsOf(gridOf(settings));
  std::erase_if(points, [&shard](const SweepPoint& point) { return !shard.has(point.index); });
  FeelProbe feel(settings.quick ? 1.5 : 1.15);
  std::vector<SweepResult> results;
  for (const SweepPoint& point : points) {
    SweepResult result{point, feel.measure(parametersOf(point)), {}, std::numeric_limits<double>::infinity()};
    rt::LiveParameters felt = parametersOf(point);
    if (settings.filter) felt.filter = sweepFilter();
    result.noise = noise.measure(felt, result.feel.stroke_h_m);
    const double steepest = result.feel.steepest_stiffness_n_per_m;
    if (steepest > 0) result.stability_margin = limit_n_per_m / steepest;
    results.push_back(result);
    progress(results.size(), points.size());
  }
  return results;
}

}  // namespace hapticd::tools
