// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "rt/fixture.h"
#include "rt/force_law.h"
#include "rt/guidance.h"
#include "rt/half_spaces.h"
#include "rt/parameters.h"
#include "rt/scene.h"
#include "rt/surface_distance.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// What a fixture keeps from one tick to the next.
struct FixtureMemory {
  std::uint64_t definition = 0;  ///< 0: not acting
  std::uint32_t identity = 0;
  Shape shape;  ///< in the last tick
  /// The HIP is at least this far from the region's boundary, on the allowed side; 0: not known.
  double room_m = 0;
  bool inside = false;  ///< side `both`: the HIP is kept inside
  double give_m = 0;    ///< the region is smaller by this, because the HIP was inside when it began to act
  double give_m_per_s = 0;  ///< ... and grows by this
  bool has_own_proxy = false;
  Vec3 own_proxy_m;         ///< proxy that obeys this region only
  HalfSpace last;           ///< stand-off: the newest constraint ...
  std::uint64_t frame = 0;  ///< ... and the depth frame that it was seen in; 0: none
  /// Stand-off: the last look at the surface from next to the proxy, for the start of the next tick.
  struct SurfaceLook {
    bool found = false;
    std::uint64_t model = 0;  ///< scene that was looked at
    Vec3 from_m;              ///< place looked from
    double distance_m = 0;    ///< from there to the surface
    HalfSpace half_space;     ///< the constraint that followed
    double speed_m_per_s = 0;
    double age_s = 0;  ///< FixtureInput::frame_age_s
  };
  SurfaceLook look;
  GuidanceMemory guidance;
};

/// What all fixtures keep from one tick to the next.
struct FixturesMemory {
  std::uint64_t generation = 0;
  bool placed = false;
  Vec3 proxy_m_in_world;
  Vec3 hip_m_in_world;   ///< of the last tick
  Vec3 left_guidance_n;  ///< of guidance fixtures that are gone, on its way to zero
  std::array<FixtureMemory, kMaxFixtures> fixtures;
};
static_assert(std::is_trivially_copyable_v<FixturesMemory>);

/// Input of one tick of all fixtures.
struct FixtureInput {
  const FixtureSet& set;
  const Scene& scene;
  Vec3 hip_m_in_world;  ///< finite
  Vec3 velocity_m_per_s_in_world;
  const LiveParameters& parameters;
  const ForceSample& law;    ///< force of the law in this tick
  bool surface_law = false;  ///< it comes from the law `surface`
  double frame_age_s = 0;    ///< see LawInput
  double period_s = 0;
  double lag_damping_s = 0;  ///< damping per stiffness that the loop's lag requires
};

/// The forbidden regions in one tick: how they begin to act, change and grow, and how far places are from
/// them.
/// Thread: one.  RT: safe.
class ForbiddenRegions {
 public:
  /// `input` and `memory` outlive the object.
  ForbiddenRegions(const FixtureInput& input, FixturesMemory& memory) noexcept;

  std::size_t count() const noexcept { return input_.set.count; }
  const Fixture& fixture(std::size_t i) const noexcept { return input_.set.fixtures[i]; }
  FixtureMemory& memoryOf(std::size_t i) const noexcept { return memory_.fixtures[i]; }
  /// Returns whether fixture i is a forbidden region that acts.
  bool isForbidden(std::size_t i) const noexcept {
    return memoryOf(i).definition != 0 && !isGuidance(fixture(i).kind);
  }
  bool isStandoff(std::size_t i) const noexcept { return fixture(i).kind == FixtureKind::standoff; }
  /// Returns whether the HIP is kept inside the solid of fixture i.
  bool keepsInside(std::size_t i) const noexcept;

  /// Adapts the memory to a changed set, in which a fixture may have another place. Returns whether the set
  /// is another one than in the last tick.
  bool takeOver(const Vec3& proxy) noexcept;

  /// Regions that began smaller grow, and those that the HIP has left at once.
  void grow() noexcept;

  /// The signed distance of a place from a region's boundary, positive where it is allowed. Infinite for a
  /// stand-off without a surface nearby.
  SignedDistance evaluate(std::size_t i, const Vec3& p) noexcept;

  /// The constraint of stand-off i that its last look gave, at the time of this tick; null: the surface must
  /// be looked at from `proxy`. `surface_m`: distance of the proxy from the surface at least.
  const HalfSpace* expected(std::size_t i, const Vec3& proxy, double& surface_m) noexcept;

  /// Remembers the constraint that followed from a look of stand-off i from the proxy.
  void rememberLook(std::size_t i, const Vec3& proxy, const SignedDistance& here,
                    const HalfSpace& half_space) const noexcept;

  /// Looks at the live surface, which must exist; the same place again costs nothing.
  const SurfaceDistance::Result& look(const Vec3& p) noexcept;

  /// Keeps how far the HIP is from a region at least. The live surface moves with each frame.
  void remember(std::size_t i, double room_m) const noexcept {
    memoryOf(i).room_m = isStandoff(i) ? 0 : room_m;
  }

  /// A region that moved since the last tick begins with the half-space that moved along, so that the proxy
  /// stays on its side; null: it did not move.
  const HalfSpace* carried(std::size_t i) const noexcept { return is_carried_[i] ? &carried_[i] : nullptr; }

  /// The live surface; null where there is none to obey.
  SurfaceDistance* surface() noexcept { return surface_ ? &*surface_ : nullptr; }
  /// The last look for stand-off i found the surface.
  bool standoffSeen(std::size_t i) const noexcept { return standoff_seen_[i]; }
  /// Speed of the surface that a stand-off is above, along its normal.
  double speed_m_per_s(std::size_t i) const noexcept { return speed_m_per_s_[i]; }

 private:
  void begin(std::size_t i, const Vec3& proxy) noexcept;
  bool carryOver(std::size_t i, const FixtureMemory& known, const Vec3& proxy) noexcept;
  SignedDistance evaluateStandoff(std::size_t i, const Vec3& p) noexcept;

  const FixtureInput& input_;
  FixturesMemory& memory_;
  const Vec3 hip_;
  std::optional<SurfaceDistance> surface_;
  std::array<HalfSpace, kMaxFixtures> carried_;
  std::array<bool, kMaxFixtures> is_carried_{};
  std::array<double, kMaxFixtures> speed_m_per_s_{};
  std::array<bool, kMaxFixtures> standoff_seen_{};
  double range_m_ = 0;  ///< of looks at the live surface
  bool looked_ = false;
  Vec3 looked_from_m_;
  SurfaceDistance::Result looked_result_;
  HalfSpace expected_;
};

}  // namespace hapticd::rt
