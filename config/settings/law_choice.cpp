// SPDX-License-Identifier: Apache-2.0
#include "config/settings/law_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "rt/depth/depth_model.h"

namespace hapticd::config {
namespace {

constexpr MeasuredLaw kMeasured[] = {
#include "config/settings/measured_laws.inc"
};

using Column = double MeasuredLaw::*;

/// Returns `result` of a law where `column` has a value, interpolated on logarithmic axes.
double interpolated(rt::ForceLaw law, bool filtered, Column column, double value, Column result) {
  const MeasuredLaw* below = nullptr;
  for (const MeasuredLaw& measured : kMeasured) {
    if (measured.law != law || measured.filtered != filtered) continue;
    if (measured.*column >= value) {
      if (below == nullptr) return measured.*result;
      const double share = std::log(value / below->*column) / std::log(measured.*column / below->*column);
      return below->*result * std::pow(measured.*result / below->*result, share);
    }
    below = &measured;
  }
  return below != nullptr ? below->*result : 0;
}

/// A law with what is expected of it.
struct Candidate {
  rt::ForceLaw law;
  bool filtered;
  double error_m;
  double cpu_ms_per_s;
};

/// Returns each law once without and, where that was measured, once with its filter.
std::vector<Candidate> candidatesFor(const SurfaceAsSeen& seen) {
  std::vector<Candidate> candidates;
  for (const MeasuredLaw& measured : kMeasured) {
    const auto [law, filtered] = std::pair(measured.law, measured.filtered);
    const bool is_first =
        candidates.empty() || candidates.back().law != law || candidates.back().filtered != filtered;
    if (!is_first) continue;
    candidates.push_back(
        {law, filtered, expectedError_m(law, filtered, seen.noise_m),
         interpolated(law, filtered, &MeasuredLaw::pitch_m, seen.pitch_m, &MeasuredLaw::cpu_ms_per_s)});
  }
  return candidates;
}

/// Returns all values of a column with three more between each two.
std::vector<double> valuesOf(Column column) {
  constexpr int kSteps = 4;
  std::set<double> measured;
  for (const MeasuredLaw& row : kMeasured) measured.insert(row.*column);
  std::vector<double> values;
  for (auto value = measured.begin(); value != measured.end(); ++value) {
    const auto next = std::next(value);
    const double ratio = next == measured.end() ? 1 : *next / *value;
    for (int step = 0; step < (ratio > 1 ? kSteps : 1); ++step)
      values.push_back(*value * std::pow(ratio, static_cast<double>(step) / kSteps));
  }
  return values;
}

/// Returns the cheapest of the candidates whose error is at most `most_m`; null: there is none.
const Candidate* cheapestWithin(const std::vector<Candidate>& candidates, double most_m) {
  const Candidate* cheapest = nullptr;
  for (const Candidate& candidate : candidates) {
    if (candidate.error_m > most_m) continue;
    if (cheapest == nullptr || candidate.cpu_ms_per_s < cheapest->cpu_ms_per_s) cheapest = &candidate;
  }
  return cheapest;
}

}  // namespace

std::span<const MeasuredLaw> measuredLaws() {
  return kMeasured;
}

SurfaceAsSeen asSeenBy(const rt::DepthModelParameters& camera, double distance_m) {
  constexpr int kSupport_px = 12;
  rt::DepthModelParameters known = camera;
  if (!camera.noise.isKnown()) {
    known = {};
    known.noise.c2_per_m = rt::kKinectNoise_raw * std::abs(known.a_per_m);
  }
  return {.noise_m = rt::noiseOfPixel_m(known, distance_m) *
                     rt::noiseOfMean(kSupport_px, known.noise.correlation_px),
          .pitch_m = distance_m / camera.fx_px};
}

double expectedError_m(rt::ForceLaw law, bool filtered, double noise_m) {
  return interpolated(law, filtered, &MeasuredLaw::noise_m, noise_m, &MeasuredLaw::error_m);
}

SurfaceAsSeen steady(const SurfaceAsSeen& seen, const SurfaceAsSeen& before) {
  constexpr double kDistance = 1.05;
  const auto isNear = [](double one, double other, double ratio) {
    return other > 0 && std::max(one / other, other / one) <= ratio;
  };
  // The noise of a camera that triangulates grows with the square of the distance.
  const bool near = isNear(seen.noise_m, before.noise_m, kDistance * kDistance) &&
                    isNear(seen.pitch_m, before.pitch_m, kDistance);
  return near ? before : seen;
}

LawDecision chooseLaw(double max_error_n, double stiffness_n_per_m, const SurfaceAsSeen& seen) {
  const std::vector<Candidate> candidates = candidatesFor(seen);
  // Measurements on a few scenes cannot resolve smaller differences.
  constexpr double kNextTo = 1.2;
  const Candidate* chosen = cheapestWithin(candidates, max_error_n / stiffness_n_per_m);
  const bool within = chosen != nullptr;
  if (!within) {
    const double least_m = std::ranges::min(candidates, {}, &Candidate::error_m).error_m;
    chosen = cheapestWithin(candidates, kNextTo * least_m);
  }
  LawDecision decision{.law = chosen->law,
                       .filtered = chosen->filtered,
                       .error_n = stiffness_n_per_m * chosen->error_m,
                       .within = within,
                       .reason = {}};
  const std::string budget =
      fmt::format("{:.2g} N with depth noise of {:.2g} mm", max_error_n, 1000 * seen.noise_m);
  decision.reason =
      within ? fmt::format("the cheapest of {} whose error is within {}", candidates.size(), budget)
             : fmt::format("none of {} is within {}; this one errs least, by {:.2g} N", candidates.size(),
                           budget, decision.error_n);
  return decision;
}

LawDecision chooseLaw(const Settings& settings, const SurfaceAsSeen& seen) {
  const double max_error_n = settings.effectiveMaxError_n();
  const double stiffness_n_per_m = settings.live.force.stiffness_n_per_m;
  const FixtureSettings* const standoff = widestStandoff(settings.additions.fixtures);
  if (standoff == nullptr) return chooseLaw(max_error_n, stiffness_n_per_m, seen);
  LawDecision decision{
      .law = rt::lawThat(&rt::ForceLawRow::carries_standoffs),
      .reason = fmt::format("the only law that the stand-off fixture {} can act with", standoff->name)};
  decision.error_n = stiffness_n_per_m * expectedError_m(decision.law, false, seen.noise_m);
  decision.within = decision.error_n <= max_error_n;
  return decision;
}

rt::LiveParameters liveWith(const Settings& settings, const LawDecision& decision) {
  rt::LiveParameters live = settings.effectiveLive();
  live.law = decision.law;
  live.filter = decision.filtered ? filterOfChoice() : rt::FilterParameters{};
  return live;
}

std::vector<rt::LiveParameters> lawsThatMayAct(const Settings& settings) {
  if (settings.live.force.law) return {settings.effectiveLive()};
  std::set<std::pair<rt::ForceLaw, bool>> chosen;
  std::vector<rt::LiveParameters> laws;
  const std::vector<double> pitches_m = valuesOf(&MeasuredLaw::pitch_m);
  for (const double noise_m : valuesOf(&MeasuredLaw::noise_m)) {
    for (const double pitch_m : pitches_m) {
      const LawDecision decision = chooseLaw(settings, {.noise_m = noise_m, .pitch_m = pitch_m});
      if (chosen.emplace(decision.law, decision.filtered).second)
        laws.push_back(liveWith(settings, decision));
    }
  }
  return laws;
}

}  // namespace hapticd::config
