// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "rt/base/vec3.h"
#include "tools/lib/solids/files/mesh_formats.h"

namespace hapticd::solids {

/// Triangles in LPS, metres. Each index is one of `points_m`.
struct TriangleMesh {
  std::vector<rt::Vec3> points_m;
  std::vector<Triangle> triangles;
  /// No place of the surface in the file is farther from them: faces that bend were divided into triangles,
  /// and points were merged.
  double error_m = 0;
};

/// An opening in a mesh: edges that belong to one triangle each and hang together.
struct Hole {
  rt::Vec3 centre_m;    ///< of its box
  double extent_m = 0;  ///< diagonal of its box
  std::size_t edges = 0;
};

/// What repair() changed, and what is still wrong.
struct Topology {
  std::size_t merged_points = 0;
  std::size_t flat_faces_removed = 0;       ///< two of their corners were one point
  std::size_t duplicate_faces_removed = 0;  ///< with the same corners as an earlier one, in any order
  std::size_t boundary_edges = 0;           ///< of one triangle
  std::size_t crowded_edges = 0;            ///< of more than two triangles
  std::size_t reversed_edges = 0;           ///< of two triangles that disagree about the outside
  std::vector<Hole> holes;                  ///< the widest first
};

/// Share of the diagonal of the box within which points are the same.
inline constexpr double kWeldShare = 1e-6;

/// Removes points that no face uses, merges those that are the same, removes faces that are flat or
/// duplicates, and looks at the edges. Of duplicates the first face stays: two of opposite orientation would
/// cancel each other where it is asked what lies inside. By how far points moved is added to `error_m`.
Topology repair(TriangleMesh& mesh);

/// The box of the points.
struct Bounds {
  rt::Vec3 low_m, high_m;
  double diagonal_m() const { return norm(high_m - low_m); }
};
/// Returns the box of at least one point.
Bounds boundsOf(const std::vector<rt::Vec3>& points_m);

}  // namespace hapticd::solids
