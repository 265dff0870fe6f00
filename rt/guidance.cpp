// SPDX-License-Identifier: Apache-2.0
#include "rt/guidance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hapticd::rt {
namespace {

constexpr double kEscapeAfter_s = 0.05;
constexpr double kFadeOut_s = 0.2;
/// The hand is back where the spring would pull with this share of the escape force.
constexpr double kReturnShare = 0.5;
constexpr double kMostStep_n = 0.04;
/// Damping rises to its full value over this depth outside the deadband.
constexpr double kDampingRamp_m = 0.001;
constexpr std::uint32_t kSearchedPerTick = 32;

/// Moves the place on the path to the nearest one within `most_m` of arc length.
void follow(std::span<const PathElement> elements, const Vec3& hip, double most_m,
            GuidanceMemory& memory) noexcept {
  double left_m = most_m;
  // Every element takes arc length, except that it is bounded here for those that are very short.
  constexpr int kMostElements = 16;
  for (int i = 0; i < kMostElements && left_m > 0; ++i) {
    const PathElement& element = elements[memory.element];
    const double target = nearestOn(element, hip);
    const double step = std::clamp(target - memory.along_m, -left_m, left_m);
    memory.along_m += step;
    left_m -= std::abs(step);
    if (memory.along_m <= 0 && memory.element > 0 && target <= 0) {
      const PathElement& previous = elements[memory.element - 1];
      if (!(nearestOn(previous, hip) < previous.length_m)) return;
      --memory.element;
      memory.along_m = previous.length_m;
    } else if (memory.along_m >= element.length_m && memory.element + 1 < elements.size() &&
               target >= element.length_m) {
      if (!(nearestOn(elements[memory.element + 1], hip) > 0)) return;
      ++memory.element;
      memory.along_m = 0;
    } else {
      return;
    }
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
  memory.element = memory.search_best;
  memory.along_m = nearestOn(elements[memory.element], hip);
  return true;
}

/// The HIP's offset from the path or point, across the path.
struct Offset {
  Vec3 across_m;
  Vec3 tangent;  ///< zero for a point
};

Offset offsetOf(const GuidanceInput& input, const GuidanceMemory& memory) noexcept {
  if (input.fixture.kind == FixtureKind::point)
    return {input.hip_m_in_world - input.fixture.shape.position_m_in_world, {}};
  const PlaceOnPath place = placeOn(input.elements[memory.element], memory.along_m);
  const Vec3 offset = input.hip_m_in_world - place.place_m_in_world;
  return {offset - dot(offset, place.tangent_in_world) * place.tangent_in_world, place.tangent_in_world};
}

/// Keeps the place on the path up to date. Returns false while it is not known.
bool locate(const GuidanceInput& input, GuidanceMemory& memory) noexcept {
  if (input.fixture.kind == FixtureKind::point) return memory.on_path = true;
  if (input.elements.empty()) return false;
  if (memory.on_path && !memory.escaped) {
    constexpr double kAlways_m = 0.001;
    follow(input.elements, input.hip_m_in_world, 2 * norm(input.motion_m) + kAlways_m, memory);
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
  if (memory.escaped) {
    memory.share = std::max(0.0, memory.share - input.period_s / kFadeOut_s);
  } else {
    memory.share = std::min(1.0, memory.share + input.period_s / std::max(fixture.fade_in_s, input.period_s));
  }
}

/// Limits the change of the force since the last tick.
Vec3 limitStep(const Vec3& force_n, const GuidanceInput& input, double stiffness_n_per_m,
               const Vec3& before_n) noexcept {
  const Vec3 change = force_n - before_n;
  const double length = norm(change);
  const double most = stiffness_n_per_m * norm(input.motion_m) + kMostStep_n;
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
  result.stiffness_n_per_m = std::min(fixture.stiffness_n_per_m, input.most_stiffness_n_per_m);
  Vec3 force_n;
  if (locate(input, memory)) {
    const auto [across_m, tangent] = offsetOf(input, memory);
    const double distance = norm(across_m);
    const double beyond = std::max(0.0, distance - fixture.deadband_m);
    moveShare(input, result.stiffness_n_per_m * beyond, memory);
    if (beyond > 0) {
      const double most_n = std::min(fixture.max_force_n, input.most_force_n);
      const double pull_n = std::min(result.stiffness_n_per_m * beyond, most_n);
      const double damping = fixture.damping_n_s_per_m + input.lag_damping_s * result.stiffness_n_per_m;
      const Vec3 speed = input.velocity_m_per_s - dot(input.velocity_m_per_s, tangent) * tangent;
      force_n = -memory.share *
                ((pull_n / distance) * across_m + std::min(1.0, beyond / kDampingRamp_m) * damping * speed);
      const double length = norm(force_n);
      if (length > most_n) force_n = (most_n / length) * force_n;
    }
  }
  result.force_n = memory.force_n = limitStep(force_n, input, result.stiffness_n_per_m, memory.force_n);
  return result;
}

}  // namespace hapticd::rt
