// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_run.h"

#include <limits>

#include "config/law_choice.h"
#include "tools/hapticbench/stability/sampled_theory.h"

namespace hapticd::tools {

SweepGrid gridOf(const SweepSettings& settings) {
  return settings.quick ? SweepGrid::quick() : SweepGrid{};
}

rt::LiveParameters parametersOf(const SweepPoint& point) {
  rt::LiveParameters parameters;
  parameters.law = point.law;
  parameters.springs = point.springs;
  return parameters;
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

Sweep::Sweep(const SweepSettings& settings, const NoiseProbe& noise)
    : settings_(settings), noise_(noise), feel_(settings.quick ? 1.5 : 1.15, settings.timed) {
  const DeviceAndHand light{.hand_stiffness_n_per_m = 400, .hand_damping_n_s_per_m = 4};
  limit_n_per_m_ = eigenvalueLimit_n_per_m(light, {.delay_ticks = settings.delay_ticks});
}

SweepResult Sweep::measure(const SweepPoint& point) {
  SweepResult result{point, feel_.measure(parametersOf(point)), {}, std::numeric_limits<double>::infinity()};
  rt::LiveParameters filtered = parametersOf(point);
  if (settings_.filter) filtered.filter = config::filterOfChoice();
  result.noise = noise_.measure(filtered, result.feel.stroke_h_m);
  const double steepest = result.feel.steepest_stiffness_n_per_m;
  if (steepest > 0) result.stability_margin = limit_n_per_m_ / steepest;
  return result;
}

}  // namespace hapticd::tools
