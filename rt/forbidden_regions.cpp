// SPDX-License-Identifier: Apache-2.0
#include "rt/forbidden_regions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::rt {
namespace {

/// A region that appears around the HIP grows by no more than this per second.
constexpr double kMaxGrowth_m_per_s = 0.005;
/// A fixture that is moved by more at once is treated as a new one.
constexpr double kMaxMove_m = 0.02;
/// Number of frames for which a stand-off is held where the surface has no measurement.
constexpr std::uint64_t kHeldFrames = 30;

/// Stand-offs look for the surface from this far in front of their boundary.
constexpr double kAhead_m = 0.01;
/// A look serves for the first step of the next tick if the proxy is no farther from where it was taken.
constexpr double kNextToLook_m = 5e-4;

/// Rotates a vector by the smallest rotation that takes one unit vector to another.
Vec3 rotatedLike(const Vec3& v, const Vec3& from, const Vec3& to) noexcept {
  const Vec3 axis = cross(from, to);
  const double cosine = dot(from, to);
  if (cosine < -0.999999) return v - 2 * dot(v, from) * from;
  return v + cross(axis, v) + (1 / (1 + cosine)) * cross(axis, cross(axis, v));
}

Vec3 times(const std::array<double, 9>& r, const Vec3& v) noexcept {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}
Vec3 transposedTimes(const std::array<double, 9>& r, const Vec3& v) noexcept {
  return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
          r[2] * v.x + r[5] * v.y + r[8] * v.z};
}

/// Carries a direction along with a shape that is rotated from one pose to another.
Vec3 carriedAlong(const Vec3& direction, const Shape& from, const Shape& to) noexcept {
  if (from.kind == ShapeKind::box) return times(to.rotation, transposedTimes(from.rotation, direction));
  if (from.kind == ShapeKind::sphere) return direction;
  return rotatedLike(direction, from.axis_in_world, to.axis_in_world);
}

/// The shape as a solid is not allowed inside (true) or outside.
bool keepsInside(const Fixture& fixture, bool inside) noexcept {
  return fixture.side == FixtureSide::in || (fixture.side == FixtureSide::both && inside);
}

SignedDistance allowedSide(const SignedDistance& solid, bool inside, double clearance_m) noexcept {
  if (!inside) return {solid.distance_m - clearance_m, solid.normal_in_world};
  return {-solid.distance_m - clearance_m, -solid.normal_in_world};
}

const FixtureMemory* find(const std::array<FixtureMemory, kMaxFixtures>& memories,
                          std::uint32_t identity) noexcept {
  const auto found = std::ranges::find_if(memories, [identity](const FixtureMemory& memory) {
    return memory.definition != 0 && memory.identity == identity;
  });
  return found == memories.end() ? nullptr : &*found;
}

}  // namespace

ForbiddenRegions::ForbiddenRegions(const FixtureInput& input, FixturesMemory& memory) noexcept
    : input_(input), memory_(memory), hip_(input.hip_m_in_world) {
  if (input.surface_law && input.scene.has_surface)
    surface_.emplace(input.scene, input.parameters.surface.shell_m, input.frame_age_s);
  double clearance_m = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    if (isStandoff(i) && fixture(i).enabled) clearance_m = std::max(clearance_m, fixture(i).clearance_m);
  }
  range_m_ = clearance_m + kAhead_m;
}

const SurfaceDistance::Result& ForbiddenRegions::look(const Vec3& p) noexcept {
  if (looked_ && p == looked_from_m_) return looked_result_;
  looked_ = true;
  looked_from_m_ = p;
  looked_result_ = surface_->at(p, range_m_);
  return looked_result_;
}

const HalfSpace* ForbiddenRegions::expected(std::size_t i, const Vec3& proxy, double& surface_m) noexcept {
  const FixtureMemory::SurfaceLook& last = memoryOf(i).look;
  if (!surface_ || !last.found || last.model != input_.scene.model || memoryOf(i).give_m > 0) return nullptr;
  const double off_m = norm(proxy - last.from_m);
  if (off_m > kNextToLook_m) return nullptr;
  const double moved_m = last.speed_m_per_s * (input_.frame_age_s - last.age_s);
  surface_m = last.distance_m - off_m - std::abs(moved_m);
  expected_ = {last.half_space.normal, last.half_space.offset_m + moved_m};
  return &expected_;
}

void ForbiddenRegions::rememberLook(std::size_t i, const Vec3& proxy, const SignedDistance& here,
                                    const HalfSpace& half_space) const noexcept {
  const double surface_m = here.distance_m + fixture(i).clearance_m - memoryOf(i).give_m;
  memoryOf(i).look = {standoff_seen_[i], input_.scene.model, proxy, surface_m, half_space,
                      speed_m_per_s_[i], input_.frame_age_s};
}

bool ForbiddenRegions::keepsInside(std::size_t i) const noexcept {
  return rt::keepsInside(fixture(i), memoryOf(i).inside);
}

bool ForbiddenRegions::takeOver(const Vec3& proxy) noexcept {
  const bool redefined = memory_.placed && memory_.generation != input_.set.generation;
  if (memory_.placed && !redefined) return false;
  const auto before = memory_.fixtures;
  memory_.fixtures = {};
  for (std::size_t i = 0; i < input_.set.count; ++i) {
    if (!fixture(i).enabled) continue;
    const FixtureMemory* const known = find(before, fixture(i).identity);
    if (known != nullptr && known->definition == fixture(i).definition) {
      memoryOf(i) = *known;
    } else if (known == nullptr || isGuidance(fixture(i).kind) || !carryOver(i, *known, proxy)) {
      begin(i, proxy);
    }
  }
  for (const FixtureMemory& old : before) {
    const FixtureMemory* const kept = old.definition == 0 ? nullptr : find(memory_.fixtures, old.identity);
    const bool same = kept != nullptr && kept->definition == old.definition;
    if (!same) memory_.left_guidance_n += old.guidance.force_n;
  }
  return redefined;
}

/// Starts a fixture anew. If HIP or proxy are inside the region, it begins smaller and grows to its size.
void ForbiddenRegions::begin(std::size_t i, const Vec3& proxy) noexcept {
  FixtureMemory& memory = memoryOf(i);
  memory = {};
  memory.definition = fixture(i).definition;
  memory.identity = fixture(i).identity;
  memory.shape = fixture(i).shape;
  if (isGuidance(fixture(i).kind)) return;
  if (fixture(i).side == FixtureSide::both)
    memory.inside = distanceFrom(fixture(i).shape, hip_).distance_m < 0;
  const double inside_m = std::max(-evaluate(i, hip_).distance_m, -evaluate(i, proxy).distance_m);
  if (!(inside_m > 0) || !std::isfinite(inside_m)) return;
  memory.give_m = inside_m;
  memory.give_m_per_s =
      std::min(kMaxGrowth_m_per_s, inside_m / std::max(fixture(i).fade_in_s, input_.period_s));
}

/// Moves a region that has changed together with the side on which the proxy is, however thin it is.
/// Returns false if it moved too far for that.
bool ForbiddenRegions::carryOver(std::size_t i, const FixtureMemory& known, const Vec3& proxy) noexcept {
  FixtureMemory& memory = memoryOf(i);
  memory = known;
  memory.definition = fixture(i).definition;
  memory.look = {};
  if (fixture(i).kind == FixtureKind::standoff) return true;
  const Shape& shape = fixture(i).shape;
  memory.shape = shape;
  if (known.shape.kind != shape.kind) return false;
  const bool inside = rt::keepsInside(fixture(i), known.inside);
  const SignedDistance old = allowedSide(distanceFrom(known.shape, proxy), inside, fixture(i).clearance_m);
  const Vec3 foot = proxy - old.distance_m * old.normal_in_world;
  const Vec3 new_foot =
      shape.position_m_in_world + carriedAlong(foot - known.shape.position_m_in_world, known.shape, shape);
  if (norm(new_foot - foot) > kMaxMove_m) return false;
  const Vec3 normal = carriedAlong(old.normal_in_world, known.shape, shape);
  const double off = allowedSide(distanceFrom(shape, new_foot), inside, fixture(i).clearance_m).distance_m;
  if (!(std::abs(off) < kMaxMove_m)) return false;
  carried_[i] = {normal, dot(normal, new_foot) - off};
  is_carried_[i] = true;
  return true;
}

SignedDistance ForbiddenRegions::evaluate(std::size_t i, const Vec3& p) noexcept {
  const Fixture& f = fixture(i);
  if (f.kind == FixtureKind::standoff) return evaluateStandoff(i, p);
  SignedDistance result = allowedSide(distanceFrom(f.shape, p), keepsInside(i), f.clearance_m);
  result.distance_m += memoryOf(i).give_m;
  return result;
}

SignedDistance ForbiddenRegions::evaluateStandoff(std::size_t i, const Vec3& p) noexcept {
  const Fixture& f = fixture(i);
  const FixtureMemory& memory = memoryOf(i);
  const SurfaceDistance::Result result = surface_ ? look(p) : SurfaceDistance::Result{};
  standoff_seen_[i] = result.found();
  speed_m_per_s_[i] = result.speed_m_per_s;
  if (result.found()) {
    SignedDistance found = result.signed_distance;
    found.distance_m += memory.give_m - f.clearance_m;
    return found;
  }
  const bool held =
      memory.frame != 0 && input_.scene.frame - memory.frame <= kHeldFrames && memory.last.room_m(hip_) < 0;
  if (held) return {memory.last.room_m(p), memory.last.normal};
  return {std::numeric_limits<double>::infinity(), {}};
}

void ForbiddenRegions::grow() noexcept {
  for (std::size_t i = 0; i < input_.set.count; ++i) {
    FixtureMemory& memory = memoryOf(i);
    if (memory.definition == 0 || !(memory.give_m > 0)) continue;
    const double room_m = evaluate(i, hip_).distance_m;
    memory.give_m -= std::max(memory.give_m_per_s * input_.period_s, std::min(room_m, memory.give_m));
    memory.give_m = std::max(0.0, memory.give_m);
  }
}

}  // namespace hapticd::rt
