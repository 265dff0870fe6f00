// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/base/vec3.h"
#include "tools/hapticbench/solids/bodies.h"
#include "tools/lib/solids/field/triangle_tree.h"

namespace hapticd::tools {

/// A place seen from a mesh.
struct ExactPlace {
  double distance_m = 0;  ///< signed, negative inside
  rt::Vec3 foot_m;        ///< the nearest point of the mesh
  rt::Vec3 gradient;      ///< unit vector; where the place is on the mesh, zero
};

/// The surface of a closed mesh without sampling: the nearest triangle decides about the distance, the
/// winding number about the sign.  Thread: any.
class ExactSurface {
 public:
  explicit ExactSurface(const Body& body) : tree_(body.mesh), edges_(body.edges) {}

  ExactPlace at(const rt::Vec3& place_m) const;
  /// The same with the sign of a place whose side is known: `is_inside`.
  ExactPlace at(const rt::Vec3& place_m, bool is_inside) const;
  bool isNearEdge(const rt::Vec3& foot_m, double reach_m) const;
  /// True where the same part of the surface stays the nearest one for another `reach_m` away from it: the
  /// place is not next to a medial surface, where the distance has a kink.
  bool isAloneFor(const ExactPlace& place, double reach_m) const;

 private:
  solids::TriangleTree tree_;
  std::vector<Segment> edges_;
};

/// The nearest point of a triangle.
rt::Vec3 nearestOfTriangle(const std::array<rt::Vec3, 3>& corners_m, const rt::Vec3& place_m);

}  // namespace hapticd::tools
