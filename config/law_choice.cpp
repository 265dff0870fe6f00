// SPDX-License-Identifier: Apache-2.0
#include "config/law_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

namespace hapticd::config {
namespace {

constexpr MeasuredLaw kMeasured[] = {
#include "config/measured_laws.inc"
};

/// Noise of one pixel of a Kinect v1 in raw units: sigma_Z = kKinectNoise_raw |a| Z^2. A standing part of 0.5
/// and a temporal part of 0.2, the noise with which the laws were measured.
constexpr double kKinectNoise_raw = 0.54;

/// Factor by which a distance must be beyond the border of its class to change the class.
constexpr double kHysteresis = 1.05;

/// Returns the cheapest law at the same distance whose error is close to that of the most accurate one;
/// measurements on a few scenes cannot resolve smaller differences.
const MeasuredLaw* cheapestNear(const MeasuredLaw& most_accurate) {
  constexpr double kNextTo = 1.2;
  const MeasuredLaw* cheapest = &most_accurate;
  for (const MeasuredLaw& measured : kMeasured) {
    const bool near = measured.distance_m == most_accurate.distance_m &&
                      measured.error_m <= kNextTo * most_accurate.error_m;
    if (near && measured.cpu_ms_per_s < cheapest->cpu_ms_per_s) cheapest = &measured;
  }
  return cheapest;
}

std::string budgetText(double max_error_n, double distance_m) {
  return fmt::format("{:.2g} N at {:.1f} m", max_error_n, distance_m);
}

}  // namespace

std::span<const MeasuredLaw> measuredLaws() {
  return kMeasured;
}

double equivalentDistance_m(const rt::DepthModelParameters& camera, double distance_m) {
  if (camera.law == rt::DepthLawKind::reciprocal || !camera.noise.isKnown()) return distance_m;
  const double kinect_per_m = kKinectNoise_raw * std::abs(rt::DepthModelParameters{}.a_per_m);
  return std::sqrt(camera.noise.sigma_m(distance_m) / kinect_per_m);
}

double distanceClass_m(double distance_m, double before_m) {
  const auto apart = [distance_m](double class_m) { return std::abs(std::log(distance_m / class_m)); };
  const MeasuredLaw* const nearest = std::ranges::min_element(
      kMeasured, {}, [&apart](const MeasuredLaw& measured) { return apart(measured.distance_m); });
  if (before_m > 0 && apart(before_m) < apart(nearest->distance_m) + 2 * std::log(kHysteresis))
    return before_m;
  return nearest->distance_m;
}

LawDecision chooseLaw(double max_error_n, double stiffness_n_per_m, double class_m) {
  const MeasuredLaw* cheapest = nullptr;
  const MeasuredLaw* most_accurate = nullptr;
  int candidates = 0;
  for (const MeasuredLaw& measured : kMeasured) {
    if (measured.distance_m != class_m) continue;
    ++candidates;
    if (most_accurate == nullptr || measured.error_m < most_accurate->error_m) most_accurate = &measured;
    if (stiffness_n_per_m * measured.error_m > max_error_n) continue;
    if (cheapest == nullptr || measured.cpu_ms_per_s < cheapest->cpu_ms_per_s) cheapest = &measured;
  }
  if (most_accurate == nullptr) return {};
  const MeasuredLaw* const chosen = cheapest != nullptr ? cheapest : cheapestNear(*most_accurate);
  LawDecision decision{.law = chosen->law,
                       .filtered = chosen->filtered,
                       .error_n = stiffness_n_per_m * chosen->error_m,
                       .within = cheapest != nullptr,
                       .reason = {}};
  const std::string budget = budgetText(max_error_n, class_m);
  decision.reason = decision.within
                        ? fmt::format("the cheapest of {} whose error is within {}", candidates, budget)
                        : fmt::format("none of {} is within {}; this one errs least, by {:.2g} N", candidates,
                                      budget, decision.error_n);
  return decision;
}

LawDecision chooseLaw(const Settings& settings, double class_m) {
  const double max_error_n = settings.force.effectiveMaxError_n(settings.live.safety);
  const double stiffness_n_per_m = settings.live.springs.stiffness_n_per_m;
  const FixtureSettings* const standoff = widestStandoff(settings.additions.fixtures);
  if (standoff == nullptr) return chooseLaw(max_error_n, stiffness_n_per_m, class_m);
  LawDecision decision{
      .law = rt::ForceLaw::surface,
      .reason = fmt::format("the only law that the stand-off fixture {} can act with", standoff->name)};
  for (const MeasuredLaw& measured : kMeasured) {
    if (measured.law != rt::ForceLaw::surface || measured.distance_m != class_m) continue;
    decision.error_n = stiffness_n_per_m * measured.error_m;
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
  std::set<double> classes_m;
  for (const MeasuredLaw& measured : kMeasured) classes_m.insert(measured.distance_m);
  std::vector<rt::LiveParameters> laws;
  for (const double class_m : classes_m) {
    laws.push_back(liveWith(settings, chooseLaw(settings, class_m)));
  }
  return laws;
}

}  // namespace hapticd::config
