// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/sweep/sweep_run.h"

namespace hapticd::tools {

/// What a set must keep to be recommended.
struct SweepConstraints {
  double smallest_margin = 2;  ///< of stability: half the damping may be missing
  double smallest_pop_through_n =
      4;                         ///< what the shipped force limit lets a hand feel, so what it may push with
  double largest_time_us = 100;  ///< a tenth of a tick
  double largest_noise_by_papers = 2;  ///< times the noise of the paper's set
};

/// The empty text where all constraints are kept, else those broken.
std::string brokenBy(const SweepResult& result, const SweepResult& papers,
                     const SweepConstraints& constraints = {});

/// How much better than the paper's set, in doublings: log2 of felt stiffness, plus log2 of pop-through
/// force, minus log2 of edge radius and of smallest ridge, minus half of log2 of noise; each by the paper's.
/// Noise counts half because filters take it out before the law, while nothing gives a lost stiffness back;
/// were it counted in full, the stiffness of a constraint law would have no effect at all. Time is a
/// constraint and no part of the score, so that the same sweep recommends the same set on every machine.
/// Below 1 mm of edge, 0.2 mm of ridge and 0.01 N of noise nothing more is gained. A ridge that was not felt
/// counts as 40 mm.
double scoreOf(const SweepResult& result, const SweepResult& papers);

/// The highest score of those that break no constraint, of each law and of all; of equal ones the first.
/// Empty where the paper's set is not among the results, which must outlive it.
struct Recommendation {
  const SweepResult* papers = nullptr;
  const SweepResult* best = nullptr;            ///< of all laws; null: none keeps the constraints
  std::vector<const SweepResult*> best_of_law;  ///< in the order of the laws
};
Recommendation recommend(const std::vector<SweepResult>& results, const SweepConstraints& constraints = {});

/// Whether no other result is at least as good in all of felt stiffness, pop-through, edge, ridge, noise,
/// margin (time left out) and better in one.
bool isParetoOptimal(const SweepResult& result, const std::vector<SweepResult>& results);

}  // namespace hapticd::tools
