// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_score.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hapticd::tools {
namespace {

double ridgeOf_m(const SweepResult& result) {
  return result.feel.smallest_ridge_m > 0 ? result.feel.smallest_ridge_m : 0.04;
}

/// Larger is better in each.
std::array<double, 6> merits(const SweepResult& r) {
  return {r.feel.felt_stiffness_n_per_m,
          r.feel.pop_through_n,
          -r.feel.edge_radius_m,
          -ridgeOf_m(r),
          -r.noise.median_n,
          r.stability_margin};
}

}  // namespace

std::string brokenBy(const SweepResult& result, const SweepResult& papers,
                     const SweepConstraints& constraints) {
  std::string broken;
  const auto add = [&broken](const std::string& text) { broken += (broken.empty() ? "" : ", ") + text; };
  if (result.stability_margin < constraints.smallest_margin) {
    add(fmt::format("margin below {:g}", constraints.smallest_margin));
  }
  if (result.feel.pop_through_n < constraints.smallest_pop_through_n) {
    add(fmt::format("pops below {:g} N", constraints.smallest_pop_through_n));
  }
  if (result.feel.median_force_us > constraints.largest_time_us) {
    add(fmt::format("over {:g} us", constraints.largest_time_us));
  }
  if (result.noise.median_n > constraints.largest_noise_by_papers * papers.noise.median_n) {
    add(fmt::format("over {:g} times the paper's noise", constraints.largest_noise_by_papers));
  }
  if (result.noise.sites == 0) add("not felt on the recordings");
  return broken;
}

double scoreOf(const SweepResult& result, const SweepResult& papers) {
  const auto gain = [](double value, double reference, double floor) {
    return std::log2(std::max(value, floor) / std::max(reference, floor));
  };
  return gain(result.feel.felt_stiffness_n_per_m, papers.feel.felt_stiffness_n_per_m, 1) +
         gain(result.feel.pop_through_n, papers.feel.pop_through_n, 0.1) -
         gain(result.feel.edge_radius_m, papers.feel.edge_radius_m, 0.001) -
         gain(ridgeOf_m(result), ridgeOf_m(papers), 0.0002) -
         0.5 * gain(result.noise.median_n, papers.noise.median_n, 0.01);
}

Recommendation recommend(const std::vector<SweepResult>& results, const SweepConstraints& constraints) {
  Recommendation recommendation;
  for (const SweepResult& result : results) {
    if (result.point.isPapers()) recommendation.papers = &result;
  }
  if (recommendation.papers == nullptr) return {};
  const auto better = [&](const SweepResult& a, const SweepResult* b) {
    return b == nullptr || scoreOf(a, *recommendation.papers) > scoreOf(*b, *recommendation.papers);
  };
  for (const rt::ForceLaw law : {rt::ForceLaw::nearest_springs, rt::ForceLaw::smooth_springs,
                                 rt::ForceLaw::proxy, rt::ForceLaw::surface}) {
    const SweepResult* best = nullptr;
    for (const SweepResult& result : results) {
      if (result.point.law == law && brokenBy(result, *recommendation.papers, constraints).empty() &&
          better(result, best))
        best = &result;
    }
    if (best == nullptr) continue;
    recommendation.best_of_law.push_back(best);
    if (better(*best, recommendation.best)) recommendation.best = best;
  }
  return recommendation;
}

bool isParetoOptimal(const SweepResult& result, const std::vector<SweepResult>& results) {
  const auto own = merits(result);
  return std::none_of(results.begin(), results.end(), [&own](const SweepResult& other) {
    const auto theirs = merits(other);
    bool as_good = true;
    for (std::size_t i = 0; i < own.size(); ++i) as_good = as_good && theirs[i] >= own[i];
    return as_good && theirs != own;
  });
}

}  // namespace hapticd::tools
