// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/strokes/stroke_judge.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kNoticed_n = 0.1;  // less than that nobody notices
constexpr double kPressed_n = 0.5;  // of the true force, from which on a force must be noticed

double percent(long part, long all) {
  return all == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(all);
}

bool isNearEnd(const TrueTick& tick, const JudgeLimits& limits) {
  return tick.past_end_m && std::abs(*tick.past_end_m) <= limits.end_m;
}

double lag_m(const TrueTick& truth, const LawTick& output) {
  if (output.state == rt::ContactState::free) return 0;
  return dot(truth.hold->proxy_m - output.proxy_m, truth.along);
}

void judgeContact(const TrueTick& truth, const LawTick& output, StrokeFigures& figures) {
  const Vec3 error = output.law_force_n - truth.force_n;
  const bool pressed = norm(truth.force_n) > kPressed_n;
  ++figures.contact_ticks;
  if (pressed && norm(output.law_force_n) < kNoticed_n) ++figures.lost_ticks;
  if (pressed && dot(output.law_force_n, truth.hold->outward) < -kNoticed_n) ++figures.wrong_side_ticks;
  figures.error.add(output.law_force_n, truth.force_n);
  figures.blended.add(output.blended_force_n, truth.force_n);
  figures.along_n.add(std::abs(dot(error, truth.along)));
  figures.normal_n.add(std::abs(dot(error, truth.hold->outward)));
}

/// Returns where the force finally fell below half of the true force before the end.
std::optional<double> endOfContact_m(const std::vector<TrueTick>& truth, const std::vector<LawTick>& output) {
  double before_n = 0;
  for (const TrueTick& tick : truth) {
    if (tick.past_end_m && *tick.past_end_m < 0) before_n = norm(tick.force_n);
  }
  std::optional<double> last;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i].past_end_m) continue;
    if (!last || norm(output[i].law_force_n) > before_n / 2) last = truth[i].past_end_m;
  }
  return last;
}

}  // namespace

void EndSpread::add(double past_end_m, double pitch_m) {
  EndSpread one;
  one.ends = 1;
  one.earliest_m = one.latest_m = past_end_m;
  one.worst_pitches = std::abs(past_end_m) / pitch_m;
  add(one);
}

void EndSpread::add(const EndSpread& other) {
  if (other.ends == 0) return;
  earliest_m = ends == 0 ? other.earliest_m : std::min(earliest_m, other.earliest_m);
  latest_m = ends == 0 ? other.latest_m : std::max(latest_m, other.latest_m);
  worst_pitches = std::max(worst_pitches, other.worst_pitches);
  ends += other.ends;
}

void StrokeFigures::add(const StrokeFigures& other) {
  strokes += other.strokes;
  stopped += other.stopped;
  lagged += other.lagged;
  contact_ticks += other.contact_ticks;
  lost_ticks += other.lost_ticks;
  wrong_side_ticks += other.wrong_side_ticks;
  free_ticks += other.free_ticks;
  ghost_ticks += other.ghost_ticks;
  outside_model_ticks += other.outside_model_ticks;
  error.add(other.error);
  blended.add(other.blended);
  along_n.add(other.along_n);
  normal_n.add(other.normal_n);
  lag_m = std::max(lag_m, other.lag_m);
  ghost_n = std::max(ghost_n, other.ghost_n);
  end.add(other.end);
}

double StrokeFigures::lostPercent() const {
  return percent(lost_ticks, contact_ticks);
}

double StrokeFigures::ghostPercent() const {
  return percent(ghost_ticks, free_ticks);
}

double StrokeFigures::wrongSidePercent() const {
  return percent(wrong_side_ticks, contact_ticks);
}

StrokeFigures judgeStroke(const std::vector<TrueTick>& truth, const std::vector<LawTick>& output,
                          const JudgeLimits& limits) {
  StrokeFigures figures;
  figures.strokes = 1;
  bool behind = false;  // now
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const TrueTick& tick = truth[i];
    if (output[i].outside_model) ++figures.outside_model_ticks;
    if (isNearEnd(tick, limits)) continue;
    if (tick.hold && tick.judged) {
      judgeContact(tick, output[i], figures);
      const double lag = limits.has_proxy ? lag_m(tick, output[i]) : 0;
      behind = lag > limits.lag_m;
      if (behind) figures.lagged = 1;
      figures.lag_m = std::max(figures.lag_m, lag);
    } else if (!tick.hold && tick.clearance_m > limits.clear_m) {
      ++figures.free_ticks;
      const double force = norm(output[i].law_force_n);
      if (force > kNoticed_n) ++figures.ghost_ticks;
      figures.ghost_n = std::max(figures.ghost_n, force);
    }
  }
  figures.stopped = behind ? 1 : 0;
  if (const auto end = endOfContact_m(truth, output)) figures.end.add(*end, limits.pitch_m);
  return figures;
}

}  // namespace hapticd::tools
