// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/sweep/feel_probe.h"
#include "tools/hapticbench/sweep/noise_probe.h"
#include "tools/hapticbench/sweep/sweep_grid.h"

namespace hapticd::tools {

/// All that a sweep's results depend on, besides the program and the recordings' content.
struct SweepSettings {
  bool quick = false;
  bool filter = false;         ///< depth passes the filter before the law, where noise is measured
  bool timed = true;           ///< the time for one force is measured
  int delay_ticks = 2;         ///< of the loop whose margin is computed
  std::string noise_source{};  ///< the recordings' names, or "synthetic"
  std::string noise_digest{};  ///< of their frames
};
SweepGrid gridOf(const SweepSettings& settings);

struct SweepResult {
  SweepPoint point{};
  Feel feel{};
  ForceNoise noise{};
  /// Largest stable stiffness of a 45 g device in a light hand (400 N/m, 4 N s/m) at the stated delay by the
  /// eigenvalues, divided by the law's steepest stiffness; infinite where the law has none.
  double stability_margin = 0;
};
/// The point follows from the grid.
auto fieldsOf(Is<SweepResult> auto& result) {
  auto& [point, feel, noise, stability_margin] = result;
  return std::tie(feel, noise, stability_margin);
}

/// Returns the parameters of a point: the shipped settings except for the law and the springs.
rt::LiveParameters parametersOf(const SweepPoint& point);

/// A plane at 1.2 m with simulated sensor noise, for where there are no recordings.
BenchSequence syntheticSequence(std::size_t frames);

/// Measures points, each by itself: a point's result does not depend on which others are measured.
/// Thread: one.
class Sweep {
 public:
  /// `noise` outlives the sweep.
  Sweep(const SweepSettings& settings, const NoiseProbe& noise);
  SweepResult measure(const SweepPoint& point);

 private:
  const SweepSettings settings_;
  const NoiseProbe& noise_;
  FeelProbe feel_;
  double limit_n_per_m_;
};

}  // namespace hapticd::tools
