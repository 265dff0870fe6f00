// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "rt/fixture.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Points of a path must be at least this far apart, in metres.
inline constexpr double kLeastPointDistance_m = 0.0005;

/// Returns whether a path is a closed curve: its last point is its first, or nearer to it than two points of
/// a path may be. Such a path has at least four points.
bool isClosedPath(std::span<const Vec3> points_m) noexcept;

/// Converts a polyline to lines and arcs that continue each other without a change of direction: each bend
/// becomes an arc of `bend_radius_m` (> 0), or of less where its lines are too short. Of a closed path the
/// last element continues in the first. `points_m`: 2 to kMaxPathPoints finite points, neighbours at least
/// kLeastPointDistance_m apart, no turn of more than 175 degrees. `elements`: room for 2 * points.
/// Returns the number of elements.  RT: not safe (slow).
std::size_t smoothPath(std::span<const Vec3> points_m, double bend_radius_m, std::span<PathElement> elements);

}  // namespace hapticd::rt
