// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "tools/lib/solids/field/triangle_tree.h"
#include "tools/lib/solids/files/mesh_repair.h"

namespace hapticd::solids {

/// A mesh that is ready for sampling: faces that disagree with most of their part are turned, then parts that
/// are inside out; what of a face other parts cover is not its surface. Immutable.
class MeshBody {
 public:
  /// `mesh`: repaired, with at least one triangle.
  explicit MeshBody(TriangleMesh mesh);

  /// The faces that are not covered, and the pieces of those that are partly. Points of pieces are their own.
  const TriangleMesh& surfaceMesh() const { return surface_mesh_; }
  const TriangleTree& surface() const { return surface_; }  ///< of these
  double winding(const rt::Vec3& point_m) const { return all_.winding(point_m); }

  /// Whether the winding number is a whole number everywhere but for rounding and dipoles: each edge is run
  /// through as often in one direction as in the other.
  bool isClosed() const { return is_closed_; }
  std::size_t turnedFaces() const { return turned_faces_; }
  std::size_t hiddenFaces() const { return hidden_faces_; }  ///< covered everywhere
  std::size_t cutFaces() const { return cut_faces_; }        ///< covered in part

 private:
  std::size_t turned_faces_ = 0, hidden_faces_ = 0, cut_faces_ = 0;
  bool is_closed_ = false;
  TriangleTree all_;
  TriangleMesh surface_mesh_;
  TriangleTree surface_;
};

}  // namespace hapticd::solids
