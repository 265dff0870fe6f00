// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "rt/fixture.h"
#include "rt/forbidden_regions.h"
#include "rt/half_spaces.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Regions within this distance of the HIP count for the stiffness that can act together, and for the next
/// step of the proxy.
inline constexpr double kNearRegion_m = 0.005;

/// The common proxy of the forbidden regions in one tick, and the half-spaces that hold it (FixtureForces).
/// Thread: one.  RT: safe.
class FixtureProxy {
 public:
  /// One half-space for each fixture, those that bound regions to keep in, and the live surface.
  static constexpr std::size_t kMaxCuts = 16;
  static constexpr std::size_t kMaxHalfSpaces = kMaxFixtures + kMaxCuts + 1;
  static constexpr int kSurface = -1;  ///< instead of the number of a fixture

  /// The arguments outlive the object.
  FixtureProxy(const FixtureInput& input, FixturesMemory& memory, ForbiddenRegions& regions) noexcept;

  /// Moves the proxy to the allowed place nearest to the HIP.
  void move() noexcept;

  const Vec3& place() const noexcept { return q_; }

  /// A half-space that the proxy obeys, and how far it pushes the proxy off the HIP.
  struct Hold {
    int origin;  ///< number of the fixture, or kSurface
    const HalfSpace& half_space;
    double multiplier_m;
    bool ofSurface() const noexcept { return origin == kSurface; }
    std::size_t fixture() const noexcept { return static_cast<std::size_t>(origin); }
  };
  std::size_t holds() const noexcept { return count_; }
  Hold hold(std::size_t k) const noexcept { return {origin_[k], half_spaces_[k], multipliers_[k]}; }

 private:
  void addHalfSpace(int origin, const HalfSpace& half_space) noexcept;
  void linearise(bool first) noexcept;
  bool lineariseStandoff(std::size_t i) noexcept;
  void limitStep(double surface_distance_m) noexcept;
  void lineariseSurface() noexcept;
  void project(Vec3& place) noexcept;
  bool keepInside(Vec3& place) noexcept;

  const FixtureInput& input_;
  const FixturesMemory& memory_;
  ForbiddenRegions& regions_;
  const Vec3 hip_;
  Vec3 q_;
  std::array<HalfSpace, kMaxHalfSpaces> half_spaces_;
  std::array<double, kMaxHalfSpaces> multipliers_{};
  std::array<int, kMaxHalfSpaces> origin_;
  std::size_t count_ = 0;
  std::array<HalfSpace, kMaxCuts> cuts_;
  std::array<int, kMaxCuts> cut_origin_;
  std::size_t cut_count_ = 0;
  double step_limit_m_ = 0;
  bool near_surface_ = false;  ///< the live surface, or a stand-off in front of it, is a constraint
  bool expected_ = false;      ///< a stand-off was not looked at in this iteration
};

}  // namespace hapticd::rt
