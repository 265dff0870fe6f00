// SPDX-License-Identifier: Apache-2.0
#include "rt/fixture_forces.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "rt/contact_damping.h"
#include "rt/surface_distance.h"

namespace hapticd::rt {
namespace {

/// A region that appears around the HIP grows by no more than this per second.
constexpr double kMaxGrowth_m_per_s = 0.005;
/// A fixture that is moved by more at once is treated as a new one.
constexpr double kMaxMove_m = 0.02;
/// The proxy has arrived when it moves by less.
constexpr double kArrived_m = 1e-7;
/// The same on the live surface, which costs more to look at and is known less exactly.
constexpr double kArrivedAtSurface_m = 1e-5;
constexpr int kMaxIterations = 4;
constexpr int kMaxIterationsAtSurface = 2;
/// Damping rises to its full value over this depth.
constexpr double kDampingRamp_m = 0.001;
/// Regions within this distance of the HIP count for the stiffness that can act together.
constexpr double kNear_m = 0.005;
/// Number of frames for which a stand-off is held where the surface has no measurement.
constexpr std::uint64_t kHeldFrames = 30;
/// Guidance is weaker than contact by this factor.
constexpr double kGuidanceShare = 1.0 / 3;
/// Change per tick of the force of guidance that has ended.
constexpr double kMaxFade_n = 0.04;
/// One half-space for each fixture, those that bound regions to keep in, and the live surface.
constexpr std::size_t kMaxCuts = 16;
constexpr std::size_t kMaxHalfSpaces = kMaxFixtures + kMaxCuts + 1;
constexpr int kSurface = -1;  ///< instead of the number of a fixture

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
Vec3 carried(const Vec3& direction, const Shape& from, const Shape& to) noexcept {
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

}  // namespace

/// One tick of all fixtures.
class FixtureForces::Tick {
 public:
  Tick(const Input& input, Memory& memory) noexcept
      : input_(input), memory_(memory), hip_(input.hip_m_in_world), q_(hip_) {
    if (input.surface_law && input.scene.has_surface)
      surface_.emplace(input.scene, input.parameters.surface.shell_m, input.frame_age_s);
  }

  Output output() noexcept {
    takeOver();
    moveProxy();
    computeForces();
    computeNearest();
    guideHip();
    memory_.generation = input_.set.generation;
    memory_.placed = true;
    memory_.proxy_m_in_world = q_;
    memory_.hip_m_in_world = hip_;
    out_.proxy_m_in_world = out_.holds ? q_ : hip_;
    return out_;
  }

 private:
  const Fixture& fixture(std::size_t i) const noexcept { return input_.set.fixtures[i]; }
  FixtureMemory& memoryOf(std::size_t i) const noexcept { return memory_.fixtures[i]; }
  bool isForbidden(std::size_t i) const noexcept {
    return memoryOf(i).definition != 0 && !isGuidance(fixture(i).kind);
  }

  /// Adapts the memory to a changed set, in which a fixture may have another place.
  void takeOver() noexcept {
    out_.redefined = memory_.placed && memory_.generation != input_.set.generation;
    if (memory_.placed) q_ = memory_.proxy_m_in_world;
    if (memory_.placed && !out_.redefined) return;
    const auto before = memory_.fixtures;
    memory_.fixtures = {};
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (!fixture(i).enabled) continue;
      const FixtureMemory* const known = find(before, fixture(i).identity);
      if (known != nullptr && known->definition == fixture(i).definition) {
        memoryOf(i) = *known;
      } else if (known == nullptr || isGuidance(fixture(i).kind) || !carryOver(i, *known)) {
        begin(i);
      }
    }
    for (const FixtureMemory& old : before) {
      const FixtureMemory* const kept = old.definition == 0 ? nullptr : find(memory_.fixtures, old.identity);
      const bool same = kept != nullptr && kept->definition == old.definition;
      if (!same) memory_.left_guidance_n += old.guidance.force_n;
    }
  }

  static const FixtureMemory* find(const std::array<FixtureMemory, kMaxFixtures>& memories,
                                   std::uint32_t identity) noexcept {
    const auto found = std::ranges::find_if(memories, [identity](const FixtureMemory& memory) {
      return memory.definition != 0 && memory.identity == identity;
    });
    return found == memories.end() ? nullptr : &*found;
  }

  /// Starts a fixture anew. If HIP or proxy are inside the region, it begins smaller and grows to its size.
  void begin(std::size_t i) noexcept {
    FixtureMemory& memory = memoryOf(i);
    memory = {};
    memory.definition = fixture(i).definition;
    memory.identity = fixture(i).identity;
    memory.shape = fixture(i).shape;
    if (isGuidance(fixture(i).kind)) return;
    if (fixture(i).side == FixtureSide::both)
      memory.inside = distanceFrom(fixture(i).shape, hip_).distance_m < 0;
    const double inside_m = std::max(-evaluate(i, hip_).distance_m, -evaluate(i, q_).distance_m);
    if (!(inside_m > 0) || !std::isfinite(inside_m)) return;
    memory.give_m = inside_m;
    memory.give_m_per_s =
        std::min(kMaxGrowth_m_per_s, inside_m / std::max(fixture(i).fade_in_s, input_.period_s));
  }

  /// Moves a region that has changed together with the side on which the proxy is, however thin it is.
  /// Returns false if it moved too far for that.
  bool carryOver(std::size_t i, const FixtureMemory& known) noexcept {
    FixtureMemory& memory = memoryOf(i);
    memory = known;
    memory.definition = fixture(i).definition;
    if (fixture(i).kind == FixtureKind::standoff) return true;
    const Shape& shape = fixture(i).shape;
    memory.shape = shape;
    if (known.shape.kind != shape.kind) return false;
    const bool inside = keepsInside(fixture(i), known.inside);
    const SignedDistance old = allowedSide(distanceFrom(known.shape, q_), inside, fixture(i).clearance_m);
    const Vec3 foot = q_ - old.distance_m * old.normal_in_world;
    const Vec3 new_foot =
        shape.position_m_in_world + carried(foot - known.shape.position_m_in_world, known.shape, shape);
    if (norm(new_foot - foot) > kMaxMove_m) return false;
    const Vec3 normal = carried(old.normal_in_world, known.shape, shape);
    const double off = allowedSide(distanceFrom(shape, new_foot), inside, fixture(i).clearance_m).distance_m;
    if (!(std::abs(off) < kMaxMove_m)) return false;
    carried_[i] = {normal, dot(normal, new_foot) - off};
    is_carried_[i] = true;
    return true;
  }

  /// The signed distance of a place from a fixture's boundary, positive where it is allowed. Infinite for a
  /// stand-off without a surface nearby.
  SignedDistance evaluate(std::size_t i, const Vec3& p) noexcept {
    const Fixture& f = fixture(i);
    if (f.kind == FixtureKind::standoff) return evaluateStandoff(i, p);
    SignedDistance result =
        allowedSide(distanceFrom(f.shape, p), keepsInside(f, memoryOf(i).inside), f.clearance_m);
    result.distance_m += memoryOf(i).give_m;
    return result;
  }

  SignedDistance evaluateStandoff(std::size_t i, const Vec3& p) noexcept {
    const Fixture& f = fixture(i);
    const FixtureMemory& memory = memoryOf(i);
    constexpr double kAhead_m = 0.01;
    const SurfaceDistance::Result result =
        surface_ ? surface_->at(p, f.clearance_m + kAhead_m) : SurfaceDistance::Result{};
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

  /// Moves the proxy to the allowed place nearest to the HIP.
  void moveProxy() noexcept {
    const double moved_m = norm(hip_ - memory_.hip_m_in_world);
    for (std::size_t i = 0; i < input_.set.count; ++i) memoryOf(i).room_m -= moved_m;
    grow();
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      linearise(iteration == 0);
      Vec3 next;
      project(next);
      if (keepInside(next)) project(next);
      const double length = norm(next - q_);
      if (length > step_limit_m_) next = q_ + (step_limit_m_ / length) * (next - q_);
      const double moved = norm(next - q_);
      q_ = next;
      if (moved < (near_surface_ ? kArrivedAtSurface_m : kArrived_m)) break;
      if (near_surface_ && iteration + 1 >= kMaxIterationsAtSurface) break;
      if (q_ == hip_ && !near_surface_) break;
    }
  }

  /// Lets regions that began smaller grow, and those that the HIP has left at once.
  void grow() noexcept {
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      FixtureMemory& memory = memoryOf(i);
      if (memory.definition == 0 || !(memory.give_m > 0)) continue;
      const double room_m = evaluate(i, hip_).distance_m;
      memory.give_m -= std::max(memory.give_m_per_s * input_.period_s, std::min(room_m, memory.give_m));
      memory.give_m = std::max(0.0, memory.give_m);
    }
  }

  void addHalfSpace(int origin, const HalfSpace& half_space) noexcept {
    if (count_ == kMaxHalfSpaces) return;
    origin_[count_] = origin;
    half_spaces_[count_++] = half_space;
  }

  /// Replaces each region that the proxy may meet by a half-space.
  void linearise(bool first) noexcept {
    const double reach_m = 2 * norm(hip_ - q_) + kNear_m;
    count_ = 0;
    near_surface_ = false;
    step_limit_m_ = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (!isForbidden(i)) continue;
      if (first && is_carried_[i]) {
        addHalfSpace(static_cast<int>(i), carried_[i]);
        continue;
      }
      const double from_hip_m = norm(hip_ - q_);
      if (memoryOf(i).room_m - from_hip_m > reach_m) continue;
      const SignedDistance here = evaluate(i, q_);
      remember(i, here.distance_m - from_hip_m);
      if (here.distance_m > reach_m) continue;
      const Vec3& n = here.normal_in_world;
      const HalfSpace half_space{n, dot(n, q_) - here.distance_m};
      addHalfSpace(static_cast<int>(i), half_space);
      if (fixture(i).kind != FixtureKind::standoff) continue;
      memoryOf(i).last = half_space;
      if (standoff_seen_[i]) memoryOf(i).frame = input_.scene.frame;
      if (surface_) limitStep(here.distance_m + fixture(i).clearance_m - memoryOf(i).give_m);
    }
    if (count_ > 0 && !near_surface_) lineariseSurface();  // a stand-off is in front of it already
    for (std::size_t cut = 0; cut < cut_count_; ++cut) addHalfSpace(cut_origin_[cut], cuts_[cut]);
  }

  /// Keeps how far the HIP is from a region at least. The live surface moves with each frame.
  void remember(std::size_t i, double room_m) const noexcept {
    memoryOf(i).room_m = fixture(i).kind == FixtureKind::standoff ? 0 : room_m;
  }

  /// The live surface is curved and may end: a step is no longer than the distance from it, or two pixels.
  void limitStep(double surface_distance_m) noexcept {
    constexpr double kShare = 0.9;
    constexpr double kStride_px = 2;
    step_limit_m_ =
        std::min(step_limit_m_, std::max(kShare * surface_distance_m, kStride_px * surface_->pitch_m(q_)));
  }

  /// While a fixture holds the HIP, the proxy of the fixtures obeys the live surface too.
  void lineariseSurface() noexcept {
    if (!surface_ || q_ == hip_ || input_.law.state == ContactState::behind) return;
    constexpr double kSearch_m = 0.01;
    const SurfaceDistance::Result result = surface_->at(q_, kSearch_m);
    if (!result.found()) return;
    const SignedDistance& here = result.signed_distance;
    addHalfSpace(kSurface, {here.normal_in_world, dot(here.normal_in_world, q_) - here.distance_m});
    limitStep(here.distance_m);
  }

  void project(Vec3& place) noexcept {
    const bool feasible = projectOnto(std::span(half_spaces_).first(count_), hip_, place,
                                      std::span(multipliers_).first(count_));
    if (!feasible) place = q_;
  }

  /// Adds half-spaces until a place satisfies the regions to keep in, which are their intersection. Returns
  /// whether there are new ones.
  bool keepInside(Vec3& place) noexcept {
    constexpr int kMaxRounds = 4;
    bool added = false;
    for (int round = 0; round < kMaxRounds; ++round) {
      bool again = false;
      for (std::size_t i = 0; i < input_.set.count; ++i) {
        if (!isForbidden(i) || fixture(i).kind == FixtureKind::standoff) continue;
        if (!keepsInside(fixture(i), memoryOf(i).inside) || fixture(i).kind == FixtureKind::plane) continue;
        const SignedDistance there = evaluate(i, place);
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

  /// The force of a spring that saturates, and its energy.
  struct Spring {
    double stiffness_n_per_m;
    double most_n;
    double force_n(double depth_m) const noexcept { return std::min(stiffness_n_per_m * depth_m, most_n); }
    double energy_j(double depth_m) const noexcept {
      const double linear_m = std::min(depth_m, most_n / stiffness_n_per_m);
      return 0.5 * stiffness_n_per_m * linear_m * linear_m + most_n * (depth_m - linear_m);
    }
  };

  /// The spring that all forbidden regions have in common: the softest one with the least largest force.
  Spring commonSpring() const noexcept {
    Spring common{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (!isForbidden(i)) continue;
      common.stiffness_n_per_m = std::min(common.stiffness_n_per_m, fixture(i).stiffness_n_per_m);
      common.most_n = std::min(common.most_n, fixture(i).max_force_n);
    }
    return common;
  }

  /// Computes the force as the gradient of an energy, so that no closed loop of the HIP gains any: the common
  /// spring to the common proxy, and for each region the rest of its own spring to a proxy that obeys this
  /// region only.
  void computeForces() noexcept {
    Vec3 to_proxy;
    Vec3 to_surface;
    for (std::size_t k = 0; k < count_; ++k) {
      if (!(multipliers_[k] > 0)) continue;
      if (origin_[k] == kSurface) {
        to_surface += multipliers_[k] * half_spaces_[k].normal;
        continue;
      }
      to_proxy += multipliers_[k] * half_spaces_[k].normal;
      hold(static_cast<std::size_t>(origin_[k]), multipliers_[k]);
    }
    const Spring common = commonSpring();
    if (const double depth_m = norm(to_proxy); out_.holds && depth_m > 0) {
      out_.spring_force_n = (common.force_n(depth_m) / depth_m) * to_proxy;
      out_.stored_j = common.energy_j(depth_m);
    }
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (isForbidden(i)) pushFromOwnProxy(i, common);
    }
    out_.force_n = out_.spring_force_n;
    for (std::size_t k = 0; k < count_; ++k) {
      if (multipliers_[k] > 0 && origin_[k] != kSurface) damp(k);
    }
    const double surface_depth_m = norm(to_surface);
    if (out_.holds && surface_depth_m > 0)
      pushFromSurface((1 / surface_depth_m) * to_surface, surface_depth_m);
  }

  /// Notes that the HIP is `depth_m` deep in a region.
  void hold(std::size_t i, double depth_m) noexcept {
    out_.holds = true;
    out_.in_contact |= 1U << i;
    if (depth_[i] == 0) out_.stiffness_n_per_m += fixture(i).stiffness_n_per_m;
    depth_[i] += depth_m;
  }

  /// Adds what the spring of a region is stiffer or stronger than the common one. Its own proxy is the place
  /// on the region's boundary nearest to the HIP, followed like the common one.
  void pushFromOwnProxy(std::size_t i, const Spring& common) noexcept {
    const Fixture& f = fixture(i);
    FixtureMemory& memory = memoryOf(i);
    const Spring own{f.stiffness_n_per_m, f.max_force_n};
    if (!(depth_[i] > 0)) {
      memory.has_own_proxy = false;
      return;
    }
    const bool is_common = own.stiffness_n_per_m == common.stiffness_n_per_m && own.most_n == common.most_n;
    if (is_common) return;
    Vec3 proxy = memory.has_own_proxy ? memory.own_proxy_m : q_;
    HalfSpace half_space;
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      const SignedDistance here = evaluate(i, proxy);
      if (!std::isfinite(here.distance_m)) return;
      const Vec3& n = here.normal_in_world;
      half_space = {n, dot(n, proxy) - here.distance_m};
      proxy = hip_ + std::max(0.0, -half_space.room_m(hip_)) * n;
    }
    memory.has_own_proxy = true;
    memory.own_proxy_m = proxy;
    const double depth_m = std::max(0.0, -half_space.room_m(hip_));
    const double force_n = own.force_n(depth_m) - common.force_n(depth_m);
    out_.spring_force_n += force_n * half_space.normal;
    out_.stored_j += own.energy_j(depth_m) - common.energy_j(depth_m);
  }

  /// Damps the motion along the normal of a region that holds the HIP; the region never pulls.
  void damp(std::size_t k) noexcept {
    const auto i = static_cast<std::size_t>(origin_[k]);
    const Fixture& f = fixture(i);
    const Vec3& normal = half_spaces_[k].normal;
    const Vec3 velocity = velocityToDamp(input_.velocity_m_per_s_in_world, speed_m_per_s_[i] * normal);
    const double speed = dot(velocity, normal);
    const double ramp = std::min(1.0, multipliers_[k] / kDampingRamp_m);
    const double of_lag = input_.lag_damping_s * f.stiffness_n_per_m;
    const double more = std::max(0.0, f.damping_n_s_per_m - of_lag);  // its own, while approaching
    const double damping_n = ramp * (of_lag * speed + more * std::min(speed, 0.0));
    out_.damping_n_s_per_m += std::max(of_lag, f.damping_n_s_per_m);
    const double along_n = dot(out_.force_n, normal);
    const double damped_n = std::clamp(along_n - damping_n, 0.0, std::max(along_n, f.max_force_n));
    out_.force_n += (damped_n - along_n) * normal;
    if (f.kind != FixtureKind::standoff) return;
    const Spring own{f.stiffness_n_per_m, f.max_force_n};
    const double spring_n = own.force_n(multipliers_[k]);
    out_.standoff_force_n += spring_n * normal;
    out_.standoff_j += own.energy_j(multipliers_[k]);
    out_.standoff_power_w += spring_n * speed_m_per_s_[i];
  }

  /// In a corner between a region and the live surface the proxy is deeper behind the surface than the law's
  /// own proxy; the law's spring gets the difference.
  void pushFromSurface(const Vec3& normal, double depth_m) noexcept {
    const Vec3 law_m = isHeld(input_.law.state) ? input_.law.proxy_m_in_world - hip_ : Vec3{};
    const double more_m = depth_m - std::max(0.0, dot(law_m, normal));
    if (!(more_m > 0)) return;
    const double stiffness = input_.parameters.springs.stiffness_n_per_m;
    const double most_n = input_.parameters.safety.max_force_n;
    const Vec3 force = std::min(stiffness * more_m, most_n) * normal;
    out_.spring_force_n += force;
    out_.force_n += force;
    out_.stored_j += 0.5 * stiffness * more_m * more_m;
  }

  /// Distances for warnings, and the stiffness that can act along one normal.
  void computeNearest() noexcept {
    std::array<std::size_t, kMaxHalfSpaces> near;
    std::size_t near_count = 0;
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (!isForbidden(i)) continue;
      const Fixture& f = fixture(i);
      if (f.kind == FixtureKind::standoff) out_.joint_stiffness_n_per_m += f.stiffness_n_per_m;
      if (memoryOf(i).room_m - memoryOf(i).give_m >= out_.distance_m) continue;  // another one is nearer
      double distance_m = -depth_[i];
      if (!(depth_[i] > 0)) {
        const double room_m = evaluate(i, hip_).distance_m;
        remember(i, room_m);
        distance_m = room_m - memoryOf(i).give_m;
      }
      if (distance_m < out_.distance_m) {
        out_.distance_m = distance_m;
        out_.nearest = static_cast<std::int32_t>(i);
      }
    }
    for (std::size_t k = 0; k < count_; ++k) {
      if (origin_[k] == kSurface || half_spaces_[k].room_m(hip_) > kNear_m) continue;
      if (fixture(static_cast<std::size_t>(origin_[k])).kind != FixtureKind::standoff) near[near_count++] = k;
    }
    double most = 0;
    for (std::size_t a = 0; a < near_count; ++a) {
      double sum = 0;
      for (std::size_t b = 0; b < near_count; ++b) {
        const double along = dot(half_spaces_[near[a]].normal, half_spaces_[near[b]].normal);
        sum += std::max(0.0, along) * fixture(static_cast<std::size_t>(origin_[near[b]])).stiffness_n_per_m;
      }
      most = std::max(most, sum);
    }
    out_.joint_stiffness_n_per_m += most;
  }

  void guideHip() noexcept {
    const Vec3 motion = memory_.placed ? hip_ - memory_.hip_m_in_world : Vec3{};
    const double left = norm(memory_.left_guidance_n);
    memory_.left_guidance_n =
        left > kMaxFade_n ? ((left - kMaxFade_n) / left) * memory_.left_guidance_n : Vec3{};
    out_.guidance_force_n = memory_.left_guidance_n;
    double stiffness = 0;
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (memoryOf(i).definition == 0 || !isGuidance(fixture(i).kind)) continue;
      const GuidanceForce guidance = guide(
          {.fixture = fixture(i),
           .elements =
               std::span(input_.set.elements).subspan(fixture(i).first_element, fixture(i).element_count),
           .hip_m_in_world = hip_,
           .velocity_m_per_s = input_.velocity_m_per_s_in_world,
           .motion_m = motion,
           .most_stiffness_n_per_m = kGuidanceShare * input_.parameters.springs.stiffness_n_per_m,
           .most_force_n = kGuidanceShare * input_.parameters.safety.max_force_n,
           .lag_damping_s = input_.lag_damping_s,
           .period_s = input_.period_s},
          memoryOf(i).guidance);
      out_.guidance_force_n += guidance.force_n;
      stiffness += guidance.stiffness_n_per_m;
      if (!(guidance.force_n == Vec3{})) out_.in_contact |= 1U << i;
    }
    out_.joint_stiffness_n_per_m += stiffness;
  }

  const Input& input_;
  Memory& memory_;
  const Vec3 hip_;
  Vec3 q_;
  std::optional<SurfaceDistance> surface_;
  Output out_;
  std::array<HalfSpace, kMaxHalfSpaces> half_spaces_;
  std::array<double, kMaxHalfSpaces> multipliers_{};
  std::array<int, kMaxHalfSpaces> origin_;  ///< number of the fixture, or kSurface
  std::size_t count_ = 0;
  std::array<HalfSpace, kMaxCuts> cuts_;
  std::array<int, kMaxCuts> cut_origin_;
  std::size_t cut_count_ = 0;
  std::array<HalfSpace, kMaxFixtures> carried_;
  std::array<bool, kMaxFixtures> is_carried_{};
  std::array<double, kMaxFixtures> speed_m_per_s_{};  ///< of the surface that a stand-off is above
  std::array<bool, kMaxFixtures> standoff_seen_{};    ///< the last look found the surface
  std::array<double, kMaxFixtures> depth_{};
  double step_limit_m_ = 0;
  bool near_surface_ = false;  ///< the live surface is one of the constraints
};

FixtureForces::Output FixtureForces::step(const Input& input) HAPTICD_RT {
  Output output;
  output.proxy_m_in_world = input.hip_m_in_world;
  if (input.set.count > 0 || memory_.placed) output = Tick(input, memory_).output();
  if (input.set.count == 0 && memory_.left_guidance_n == Vec3{}) release();
  return output;
}

}  // namespace hapticd::rt
