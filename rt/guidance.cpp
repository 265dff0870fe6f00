// SPDX-License-Identifier: Apache-2.0
#include "rt/guidance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "rt/forbidden_region.h"
#include "rt/saturating_spring.h"

namespace hapticd::rt {
namespace {

constexpr double kEscapeAfter_s = 0.05;
constexpr double kFadeOut_s = 0.2;
/// The hand is back where the spring would pull with this share of the escape force.
constexpr double kReturnShare = 0.5;
/// Change of the force per tick that no motion of the HIP causes: by the place on the path, by the share of
/// the force, and by the stiffness each; and in all.
constexpr double kMaxPartialStep_n = 0.02;
constexpr double kMaxStep_n = 0.05;
/// Damping rises to its full value over this depth outside the deadband.
constexpr double kDampingRamp_m = 0.001;
constexpr std::uint32_t kSearchedPerTick = 32;
/// How much faster than the HIP the place on the path may move: on the inner side of a bend it has to.
constexpr double kFollow = 2;

/// Ends of a closed path meet within this.
constexpr double kMeets_m = 1e-6;

/// Whether the last element of a path continues in the first.
bool isClosed(std::span<const PathElement> elements) noexcept {
  const Vec3 end = placeOn(elements.back(), elements.back().length_m).place_m_in_world;
  return norm(end - elements.front().start_m_in_world) < kMeets_m;
}

/// Moves the place on the path to the nearest one within `most_m` of arc length.
void follow(std::span<const PathElement> elements, const Vec3& hip, double most_m,
            PathPosition& position) noexcept {
  double left_m = most_m;
  const auto last = static_cast<std::uint32_t>(elements.size() - 1);
  // Every element takes arc length, except that it is bounded here for those that are very short.
  constexpr int kMostElements = 16;
  for (int i = 0; i < kMostElements && left_m > 0; ++i) {
    const PathElement& element = elements[position.element];
    const double target = nearestOn(element, hip);
    const double step = std::clamp(target - position.along_m, -left_m, left_m);
    position.along_m += step;
    left_m -= std::abs(step);
    if (position.along_m <= 0 && target <= 0 && (position.element > 0 || isClosed(elements))) {
      const std::uint32_t previous = position.element > 0 ? position.element - 1 : last;
      if (!(nearestOn(elements[previous], hip) < elements[previous].length_m)) return;
      position = {previous, elements[previous].length_m};
    } else if (position.along_m >= element.length_m && target >= element.length_m &&
               (position.element < last || isClosed(elements))) {
      const std::uint32_t next = position.element < last ? position.element + 1 : 0;
      if (!(nearestOn(elements[next], hip) > 0)) return;
      position = {next, 0};
    } else {
      return;
    }
  }
}

bool isLonger(const Vec3& v, double length) noexcept {
  return dot(v, v) > length * length;
}

/// Moves the place on the path as far as the spring from it to the HIP does not step.
void followSmoothly(const GuidanceInput& input, GuidanceMemory& memory) noexcept {
  const double moved_m = norm(input.motion_m);
  const double always_m = kMaxPartialStep_n / input.fixture.stiffness_n_per_m;
  double most_m = kFollow * moved_m + always_m;
  constexpr int kHalvings = 6;
  for (int i = 0; i < kHalvings; ++i, most_m *= 0.5) {
    PathPosition moved = memory.position;
    follow(input.elements, input.hip_m_in_world, most_m, moved);
    const PlaceOnPath place = placeOn(input.elements[moved.element], moved.along_m);
    const Vec3 step = place.place_m_in_world - memory.place.place_m_in_world;
    if (isLonger(step - input.motion_m, moved_m + always_m)) continue;
    memory.position = moved;
    memory.place = place;
    return;
  }
}

/// Looks for the nearest place on the whole path, a few elements in each tick. Returns true when it is found.
bool searchNearest(std::span<const PathElement> elements, const Vec3& hip, GuidanceMemory& memory) noexcept {
  if (memory.search_next == 0) memory.search_best_m = std::numeric_limits<double>::infinity();
  const auto size = static_cast<std::uint32_t>(elements.size());
  const std::uint32_t end = std::min(size, memory.search_next + kSearchedPerTick);
  for (std::uint32_t i = memory.search_next; i < end; ++i) {
    const double distance = norm(hip - placeOn(elements[i], nearestOn(elements[i], hip)).place_m_in_world);
    if (distance >= memory.search_best_m) continue;
    memory.search_best_m = distance;
    memory.search_best = i;
  }
  memory.search_next = end;
  if (end < size) return false;
  memory.search_next = 0;
  const PathElement& nearest = elements[memory.search_best];
  memory.position = {memory.search_best, nearestOn(nearest, hip)};
  memory.place = placeOn(nearest, memory.position.along_m);
  return true;
}

/// The HIP's offset from its place on the path, or from the point. It is across the path, unless the place
/// still follows; what is beyond an end of the path does not count.
struct Offset {
  Vec3 from_place_m;
  Vec3 tangent;  ///< zero for a point
};

Offset offsetOf(const GuidanceInput& input, const GuidanceMemory& memory) noexcept {
  if (input.fixture.kind == FixtureKind::point)
    return {input.hip_m_in_world - input.fixture.shape.position_m_in_world, {}};
  const auto& [element, along_m] = memory.position;
  const PlaceOnPath& place = memory.place;
  const Vec3 offset = input.hip_m_in_world - place.place_m_in_world;
  const double ahead_m = dot(offset, place.tangent_in_world);
  const bool beyond_start = element == 0 && along_m <= 0 && ahead_m < 0;
  const bool beyond_end =
      element + 1 == input.elements.size() && along_m >= input.elements.back().length_m && ahead_m > 0;
  const bool beyond = (beyond_start || beyond_end) && !isClosed(input.elements);
  return {beyond ? offset - ahead_m * place.tangent_in_world : offset, place.tangent_in_world};
}

/// Keeps the place on the path up to date. Returns false while it is not known.
bool locate(const GuidanceInput& input, GuidanceMemory& memory) noexcept {
  if (input.fixture.kind == FixtureKind::point) return memory.on_path = true;
  if (input.elements.empty()) return false;
  if (memory.on_path && !memory.escaped) {
    followSmoothly(input, memory);
    return true;
  }
  if (searchNearest(input.elements, input.hip_m_in_world, memory)) memory.on_path = true;
  return memory.on_path;
}

/// Decides whether the fixture gives way, and moves its share of the force.
void moveShare(const GuidanceInput& input, double demand_n, GuidanceMemory& memory) noexcept {
  const Fixture& fixture = input.fixture;
  if (fixture.escape_force_n > 0) {
    memory.above_escape_s = demand_n > fixture.escape_force_n ? memory.above_escape_s + input.period_s : 0;
    if (memory.above_escape_s > kEscapeAfter_s) memory.escaped = true;
    if (memory.escaped && memory.share <= 0 && demand_n < kReturnShare * fixture.escape_force_n)
      memory.escaped = false;
  } else {
    memory.escaped = false;
  }
  if (!memory.escaped && memory.share == 1) return;
  if (memory.escaped) {
    memory.share = std::max(0.0, memory.share - input.period_s / kFadeOut_s);
  } else {
    const double rise = input.period_s / std::max(fixture.fade_in_s, input.period_s);
    memory.share = std::min(
        1.0, memory.share + (demand_n * rise > kMaxPartialStep_n ? kMaxPartialStep_n / demand_n : rise));
  }
}

/// Lets the stiffness in effect follow: upwards no faster than a region may grow (kMaxGrowth_m_per_s).
void followStiffness(double stiffness_n_per_m, double beyond_m, double period_s,
                     GuidanceMemory& memory) noexcept {
  double& now = memory.stiffness_n_per_m;
  if (now == stiffness_n_per_m) return;
  const double step_n = std::min(kMaxPartialStep_n, now * kMaxGrowth_m_per_s * period_s);
  const double highest = beyond_m > 0 && now > 0 ? now + step_n / beyond_m : stiffness_n_per_m;
  const double lowest = beyond_m > 0 ? now - kMaxPartialStep_n / beyond_m : stiffness_n_per_m;
  now = std::min(std::max(stiffness_n_per_m, lowest), highest);
}

/// Limits the change of the force since the last tick: for what steps although place, share and stiffness do
/// not, as the largest force may.
Vec3 limitStep(const Vec3& force_n, const GuidanceInput& input, double stiffness_n_per_m,
               const Vec3& before_n) noexcept {
  const Vec3 change = force_n - before_n;
  if (!isLonger(change, kMaxStep_n)) return force_n;
  const double length = norm(change);
  const double most = stiffness_n_per_m * norm(input.motion_m) + kMaxStep_n;
  return length > most ? before_n + (most / length) * change : force_n;
}

}  // namespace

PlaceOnPath placeOn(const PathElement& element, double along_m) noexcept {
  if (!(element.curvature_per_m > 0))
    return {element.start_m_in_world + along_m * element.tangent_in_world, element.tangent_in_world};
  const double angle = element.curvature_per_m * along_m;
  const double radius = 1 / element.curvature_per_m;
  const double sine = std::sin(angle);
  const double cosine = std::cos(angle);
  return {element.start_m_in_world +
              radius * (sine * element.tangent_in_world + (1 - cosine) * element.inward_in_world),
          cosine * element.tangent_in_world + sine * element.inward_in_world};
}

double nearestOn(const PathElement& element, const Vec3& p_m_in_world) noexcept {
  const Vec3 offset = p_m_in_world - element.start_m_in_world;
  if (!(element.curvature_per_m > 0))
    return std::clamp(dot(offset, element.tangent_in_world), 0.0, element.length_m);
  const double radius = 1 / element.curvature_per_m;
  double angle =
      std::atan2(dot(offset, element.tangent_in_world), radius - dot(offset, element.inward_in_world));
  // Behind the centre both ends are possible; the nearer one in angle counts.
  const double turn = element.length_m * element.curvature_per_m;
  if (angle < turn / 2 - std::numbers::pi) angle += 2 * std::numbers::pi;
  return std::clamp(angle * radius, 0.0, element.length_m);
}

GuidanceForce guide(const GuidanceInput& input, GuidanceMemory& memory) HAPTICD_RT {
  const Fixture& fixture = input.fixture;
  GuidanceForce result;
  result.located = locate(input, memory);
  double beyond_m = 0;
  Offset offset;
  if (result.located) {
    offset = offsetOf(input, memory);
    result.distance_m = norm(offset.from_place_m);
    result.tangent_in_world = offset.tangent;
    beyond_m = std::max(0.0, result.distance_m - fixture.deadband_m);
  }
  memory.stiffness_share.advance(input.period_s);
  followStiffness(std::min(fixture.stiffness_n_per_m, input.most_stiffness_n_per_m), beyond_m, input.period_s,
                  memory);
  const SaturatingSpring spring{memory.stiffness_share.value() * memory.stiffness_n_per_m,
                                std::min(fixture.max_force_n, input.most_force_n)};
  Vec3 force_n;
  if (result.located) moveShare(input, memory.stiffness_n_per_m * beyond_m, memory);
  if (beyond_m > 0) {
    const double damping = fixture.damping_n_s_per_m + input.lag_damping_s * spring.stiffness_n_per_m;
    const Vec3 speed = input.velocity_m_per_s - dot(input.velocity_m_per_s, offset.tangent) * offset.tangent;
    force_n = -memory.share * ((spring.force_n(beyond_m) / result.distance_m) * offset.from_place_m +
                               std::min(1.0, beyond_m / kDampingRamp_m) * damping * speed);
    if (isLonger(force_n, spring.max_force_n)) force_n = (spring.max_force_n / norm(force_n)) * force_n;
  }
  result.stiffness_n_per_m = memory.stiffness_n_per_m;
  result.most_force_n = spring.max_force_n;
  result.stored_j = memory.share * spring.energy_j(beyond_m);
  result.force_n = memory.force_n = limitStep(force_n, input, spring.stiffness_n_per_m, memory.force_n);
  return result;
}

}  // namespace hapticd::rt
