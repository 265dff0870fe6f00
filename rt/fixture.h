// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/shape.h"
#include "rt/triple_buffer.h"
#include "rt/vec3.h"
#include "rt/words.h"

/// Virtual fixtures as the force loop reads them. Values are checked where they enter (`config/`); names
/// stay there too, because the loop knows a fixture by its place in the set.
namespace hapticd::rt {

/// Forbidden-region fixtures hold the HIP off a region (Abbott et al.); guidance fixtures lead it along a
/// path or to a point.
enum class FixtureKind : std::uint8_t {
  standoff,  ///< a layer of clearance_m over the live surface
  plane,
  box,
  sphere,
  capsule,
  cone,
  path,   ///< guidance
  point,  ///< guidance
};
constexpr auto wordsOf(FixtureKind) {
  return words<FixtureKind>("standoff", "plane", "box", "sphere", "capsule", "cone", "path", "point");
}
constexpr bool isGuidance(FixtureKind kind) noexcept {
  return kind == FixtureKind::path || kind == FixtureKind::point;
}

/// Side of its boundary on which a forbidden-region fixture keeps the HIP.
enum class FixtureSide : std::uint8_t {
  out,   ///< outside the shape
  in,    ///< inside the shape
  both,  ///< on the side where the HIP was when the fixture began to act
};
constexpr auto wordsOf(FixtureSide) {
  return words<FixtureSide>("out", "in", "both");
}

inline constexpr std::size_t kMaxFixtures = 16;
inline constexpr std::size_t kMaxPathPoints = 256;

/// A piece of a path with constant curvature: a line or an arc of a circle.
struct PathElement {
  Vec3 start_m_in_world;
  Vec3 tangent_in_world;       ///< unit vector at the start
  Vec3 inward_in_world;        ///< arc: unit vector from the start to the centre; line: zero
  double length_m = 0;         ///< > 0
  double curvature_per_m = 0;  ///< 1 / radius; 0: a line
  double from_m = 0;           ///< arc length of the path up to the start
};
/// Each inner point of a path becomes an arc between two lines.
inline constexpr std::size_t kMaxPathElements = 2 * kMaxPathPoints;

/// One fixture.
struct Fixture {
  /// Identifies the definition: it changes when anything but `enabled` changes. 0: no fixture.
  std::uint64_t definition = 0;
  /// Identifies the fixture: it stays the same when the definition changes.
  std::uint32_t identity = 0;
  FixtureKind kind = FixtureKind::sphere;
  FixtureSide side = FixtureSide::out;
  bool enabled = true;
  Shape shape;                     ///< plane to cone; point: `position_m_in_world`
  double clearance_m = 0;          ///< forbidden regions: the region is larger by this at each boundary; >= 0
  double stiffness_n_per_m = 300;  ///< > 0
  double damping_n_s_per_m = 1;    ///< forbidden regions: while approaching; guidance: across the path; >= 0
  double deadband_m = 0;           ///< guidance: no force up to this distance from the path; >= 0
  double max_force_n = 2;          ///< > 0; limits the force, never where the proxy is
  double fade_in_s = 0.5;          ///< >= 0
  double escape_force_n = 0;       ///< guidance: it gives way above this force; 0: never
  bool fades_without_depth = false;  ///< it ends while the camera is lost; else it goes on acting
  std::uint32_t first_element = 0;   ///< path: of FixtureSet::elements
  std::uint32_t element_count = 0;   ///< path
};

/// All fixtures, as one consistent set. Large (about 1 MB): passed by reference only.
struct FixtureSet {
  std::uint64_t generation = 0;  ///< incremented with each change
  std::uint32_t count = 0;
  std::array<Fixture, kMaxFixtures> fixtures{};
  std::array<PathElement, kMaxFixtures * kMaxPathElements> elements{};
};
static_assert(std::is_trivially_copyable_v<FixtureSet>);

/// Returns whether a fixture goes on acting while the camera is lost; `fixtures` may be null.  RT: safe.
inline bool keepsWithoutDepth(const FixtureSet* fixtures) noexcept {
  for (std::size_t i = 0; fixtures != nullptr && i < fixtures->count; ++i) {
    if (fixtures->fixtures[i].enabled && !fixtures->fixtures[i].fades_without_depth) return true;
  }
  return false;
}

/// Written by the control thread, read by the force thread.
using FixtureChannel = TripleBuffer<FixtureSet>;

}  // namespace hapticd::rt
