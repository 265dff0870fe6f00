// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/fixtures/distance_grid.h"

namespace hapticd::config {

/// The points of all lines of an outline together, at most.
inline constexpr std::size_t kMaxOutlinePoints = 6000;
/// The planes across each axis in which the lines of an outline lie, at most.
inline constexpr std::uint32_t kMaxOutlinePlanes = 10;

/// A closed line on the boundary of a solid, metres, in the frame of its grid; its last point is its first
/// one.
using OutlineLine = std::vector<rt::Vec3>;

/// Returns lines that show the shape of a solid: where its boundary crosses planes at even distances along
/// each axis of its grid. Each point is on the boundary within a fiftieth of the grid's spacing. Details that
/// are smaller than a 48th of the solid may be missing; of a solid whose lines would have too many points,
/// larger ones. Empty: no place is inside the solid.  Thread: any.  RT: not safe.
std::vector<OutlineLine> outlineOf(const rt::DistanceGrid& grid);

}  // namespace hapticd::config
