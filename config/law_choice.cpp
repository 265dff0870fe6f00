// SPDX-License-Identifier: Apache-2.0
#include "config/law_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "rt/depth_model.h"

namespace hapticd::config {
namespace {

constexpr MeasuredLaw kMeasured[] = {
#include "config/measured_laws.inc"
};

/// Factors by which noise and pitch must be beyond the border of their class to change it: those of a
/// twentieth of the distance for a camera that triangulates.
constexpr double kNoiseHysteresis = 1.05 * 1.05;
constexpr double kPitchHysteresis = 1.05;

/// Returns the value of a column of the table that is nearest in ratio.
double classOf(double value, double before, double MeasuredLaw::*column, double hysteresis) {
  const auto apart = [value](double of_class) { return std::abs(std::log(value / of_class)); };
  const MeasuredLaw* const nearest = std::ranges::min_element(
      kMeasured, {}, [&](const MeasuredLaw& measured) { return apart(measured.*column); });
  if (before > 0 && apart(before) < apart(nearest->*column) + 2 * std::log(hysteresis)) return before;
  return nearest->*column;
}

/// A law of the table in a class.
struct Candidate {
  rt::ForceLaw law;
  bool filtered;
  double error_m;
  double cpu_ms_per_s;
};

/// Returns all laws in a class, with the error measured at its noise and the cost measured at its pitch.
std::vector<Candidate> candidatesIn(const SurfaceAsSeen& seen_class) {
  std::vector<Candidate> candidates;
  for (const MeasuredLaw& measured : kMeasured) {
    if (measured.noise_m != seen_class.noise_m) continue;
    const auto of_pitch = std::ranges::find_if(kMeasured, [&](const MeasuredLaw& other) {
      return other.law == measured.law && other.filtered == measured.filtered &&
             other.pitch_m == seen_class.pitch_m;
    });
    if (of_pitch == std::end(kMeasured)) continue;
    candidates.push_back({measured.law, measured.filtered, measured.error_m, of_pitch->cpu_ms_per_s});
  }
  return candidates;
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

SurfaceAsSeen classOf(const SurfaceAsSeen& surface, const SurfaceAsSeen& before) {
  return {.noise_m = classOf(surface.noise_m, before.noise_m, &MeasuredLaw::noise_m, kNoiseHysteresis),
          .pitch_m = classOf(surface.pitch_m, before.pitch_m, &MeasuredLaw::pitch_m, kPitchHysteresis)};
}

LawDecision chooseLaw(double max_error_n, double stiffness_n_per_m, const SurfaceAsSeen& seen_class) {
  const std::vector<Candidate> candidates = candidatesIn(seen_class);
  if (candidates.empty()) return {};
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
      fmt::format("{:.2g} N with depth noise of {:.2g} mm", max_error_n, 1000 * seen_class.noise_m);
  decision.reason =
      within ? fmt::format("the cheapest of {} whose error is within {}", candidates.size(), budget)
             : fmt::format("none of {} is within {}; this one errs least, by {:.2g} N", candidates.size(),
                           budget, decision.error_n);
  return decision;
}

LawDecision chooseLaw(const Settings& settings, const SurfaceAsSeen& seen_class) {
  const double max_error_n = settings.force.effectiveMaxError_n(settings.live.safety);
  const double stiffness_n_per_m = settings.live.springs.stiffness_n_per_m;
  const FixtureSettings* const standoff = widestStandoff(settings.additions.fixtures);
  if (standoff == nullptr) return chooseLaw(max_error_n, stiffness_n_per_m, seen_class);
  LawDecision decision{
      .law = rt::ForceLaw::surface,
      .reason = fmt::format("the only law that the stand-off fixture {} can act with", standoff->name)};
  for (const Candidate& candidate : candidatesIn(seen_class)) {
    if (candidate.law != rt::ForceLaw::surface) continue;
    decision.error_n = stiffness_n_per_m * candidate.error_m;
    decision.within = decision.error_n <= max_error_n;
  }
  return decision;
}

rt::LiveParameters liveWith(const Settings& settings, const LawDecision& decision) {
  rt::LiveParameters live = settings.effectiveLive();
  live.law = decision.law;
  live.filter = decision.filtered ? filterOfChoice() : rt::FilterParameters{};
  return live;
}

std::vector<rt::LiveParameters> lawsThatMayAct(const Settings& settings) {
  if (settings.force.law) return {settings.effectiveLive()};
  std::set<std::pair<rt::ForceLaw, bool>> chosen;
  std::vector<rt::LiveParameters> laws;
  for (const MeasuredLaw& of_noise : kMeasured) {
    for (const MeasuredLaw& of_pitch : kMeasured) {
      const LawDecision decision =
          chooseLaw(settings, {.noise_m = of_noise.noise_m, .pitch_m = of_pitch.pitch_m});
      if (chosen.emplace(decision.law, decision.filtered).second)
        laws.push_back(liveWith(settings, decision));
    }
  }
  return laws;
}

}  // namespace hapticd::config
