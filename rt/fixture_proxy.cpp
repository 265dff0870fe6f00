// SPDX-License-Identifier: Apache-2.0
#include "rt/fixture_proxy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace hapticd::rt {
namespace {

/// The proxy has arrived when it moves by less.
constexpr double kArrived_m = 1e-7;
/// The same on the live surface, which costs more to look at and is known less exactly.
constexpr double kArrivedAtSurface_m = 1e-5;
constexpr int kMaxIterations = 4;
constexpr int kMaxLooks = 2;

}  // namespace

FixtureProxy::FixtureProxy(const FixtureInput& input, FixturesMemory& memory,
                           ForbiddenRegions& regions) noexcept
    : input_(input),
      memory_(memory),
      regions_(regions),
      hip_(input.hip_m_in_world),
      q_(memory.placed ? memory.proxy_m_in_world : hip_) {}

void FixtureProxy::move() noexcept {
  const double moved_m = norm(hip_ - memory_.hip_m_in_world);
  for (std::size_t i = 0; i < regions_.count(); ++i) regions_.memoryOf(i).room_m -= moved_m;
  regions_.grow();
  int looks = 0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    linearise(iteration == 0);
    Vec3 next;
    project(next);
    if (keepInside(next)) project(next);
    const double length = norm(next - q_);
    if (length > step_limit_m_) next = q_ + (step_limit_m_ / length) * (next - q_);
    const double moved = norm(next - q_);
    q_ = next;
    if (expected_) continue;
    ++looks;
    if (moved < (near_surface_ ? kArrivedAtSurface_m : kArrived_m)) break;
    if (near_surface_ && looks >= kMaxLooks) break;
    if (q_ == hip_ && !near_surface_) break;
  }
}

void FixtureProxy::addHalfSpace(int origin, const HalfSpace& half_space) noexcept {
  if (count_ == kMaxHalfSpaces) return;
  origin_[count_] = origin;
  half_spaces_[count_++] = half_space;
}

/// Replaces each region that the proxy may meet by a half-space.
void FixtureProxy::linearise(bool first) noexcept {
  const double reach_m = 2 * norm(hip_ - q_) + kNearRegion_m;
  count_ = 0;
  near_surface_ = false;
  expected_ = false;
  step_limit_m_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < regions_.count(); ++i) {
    if (!regions_.isForbidden(i)) continue;
    if (first && regions_.carried(i) != nullptr) {
      addHalfSpace(static_cast<int>(i), *regions_.carried(i));
      continue;
    }
    if (first && lineariseStandoff(i)) continue;
    const double from_hip_m = norm(hip_ - q_);
    if (regions_.memoryOf(i).room_m - from_hip_m > reach_m) continue;
    const SignedDistance here = regions_.evaluate(i, q_);
    regions_.remember(i, here.distance_m - from_hip_m);
    const Vec3& n = here.normal_in_world;
    const HalfSpace half_space{n, dot(n, q_) - here.distance_m};
    if (regions_.isStandoff(i)) regions_.rememberLook(i, q_, here, half_space);
    if (here.distance_m > reach_m) continue;
    addHalfSpace(static_cast<int>(i), half_space);
    if (!regions_.isStandoff(i)) continue;
    regions_.memoryOf(i).last = half_space;
    if (regions_.standoffSeen(i)) regions_.memoryOf(i).frame = input_.scene.frame;
    if (regions_.surface() == nullptr) continue;
    const bool in_front = regions_.memoryOf(i).give_m < regions_.fixture(i).clearance_m;
    near_surface_ = near_surface_ || (regions_.standoffSeen(i) && in_front);
    limitStep(here.distance_m + regions_.fixture(i).clearance_m - regions_.memoryOf(i).give_m);
  }
  if (count_ > 0 && !near_surface_) lineariseSurface();  // a stand-off is in front of it already
  for (std::size_t cut = 0; cut < cut_count_; ++cut) addHalfSpace(cut_origin_[cut], cuts_[cut]);
}

/// Begins a tick with the constraint of a stand-off that the last look gave, which saves the look from the
/// proxy; the place that follows is looked from. Returns false if there is none.
bool FixtureProxy::lineariseStandoff(std::size_t i) noexcept {
  double surface_m = 0;
  const HalfSpace* const half_space = regions_.isStandoff(i) ? regions_.expected(i, q_, surface_m) : nullptr;
  if (half_space == nullptr) return false;
  addHalfSpace(static_cast<int>(i), *half_space);
  limitStep(surface_m);
  near_surface_ = expected_ = true;
  return true;
}

/// The live surface is curved and may end: a step is no longer than the distance from it, or two pixels.
void FixtureProxy::limitStep(double surface_distance_m) noexcept {
  constexpr double kShare = 0.9;
  constexpr double kStride_px = 2;
  step_limit_m_ = std::min(
      step_limit_m_, std::max(kShare * surface_distance_m, kStride_px * regions_.surface()->pitch_m(q_)));
}

/// While a fixture holds the HIP, the proxy of the fixtures obeys the live surface too.
void FixtureProxy::lineariseSurface() noexcept {
  if (regions_.surface() == nullptr || q_ == hip_ || input_.law.state == ContactState::behind) return;
  const SurfaceDistance::Result& result = regions_.look(q_);
  if (!result.found()) return;
  const SignedDistance& here = result.signed_distance;
  addHalfSpace(kSurface, {here.normal_in_world, dot(here.normal_in_world, q_) - here.distance_m});
  limitStep(here.distance_m);
}

void FixtureProxy::project(Vec3& place) noexcept {
  const bool feasible =
      projectOnto(std::span(half_spaces_).first(count_), hip_, place, std::span(multipliers_).first(count_));
  if (!feasible) place = q_;
}

/// Adds half-spaces until a place satisfies the regions to keep in, which are their intersection. Returns
/// whether there are new ones.
bool FixtureProxy::keepInside(Vec3& place) noexcept {
  constexpr int kMaxRounds = 4;
  bool added = false;
  for (int round = 0; round < kMaxRounds; ++round) {
    bool again = false;
    for (std::size_t i = 0; i < regions_.count(); ++i) {
      if (!regions_.isForbidden(i) || regions_.isStandoff(i)) continue;
      if (!regions_.keepsInside(i) || regions_.fixture(i).kind == FixtureKind::plane) continue;
      const SignedDistance there = regions_.evaluate(i, place);
      if (there.distance_m > -kArrived_m || cut_count_ == kMaxCuts) continue;
      const Vec3& n = there.normal_in_world;
      cut_origin_[cut_count_] = static_cast<int>(i);
      cuts_[cut_count_] = {n, dot(n, place) - there.distance_m};
      addHalfSpace(cut_origin_[cut_count_], cuts_[cut_count_]);
      ++cut_count_;
      again = true;
    }
    if (!again) return added;
    added = true;
    project(place);
  }
  return added;
}

}  // namespace hapticd::rt
