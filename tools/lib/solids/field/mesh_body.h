// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "tools/lib/solids/field/triangle_tree.h"
#include "tools/lib/solids/files/mesh_repair.h"

namespace hapticd::solids {

/// A mesh that is ready for sampling: faces that disagree with most of their part are turned, then parts that
/// are inside out; what of a face other parts cover is not its surface.
class MeshBody {
 public:
  /// `mesh`: repaired, with at least one triangle. `effort`: as of TriangleTree; it outlives the body.
  explicit MeshBody(TriangleMesh mesh, Effort* effort = nullptr);
  /// Takes off the surface what other parts cover; before, all faces are the surface.
  void uncover();

  /// The faces that are not covered, and the pieces of those that are partly. Points of pieces are their own.
  const TriangleMesh& surfaceMesh() const { return surface_mesh_; }
  const TriangleTree& surface() const { return surface_; }  ///< of these
  double winding(const rt::Vec3& point_m) const { return all_.winding(point_m); }

  /// Whether the winding number is a whole number everywhere but for rounding and dipoles: each edge is run
  /// through as often in one direction as in the other.
  bool isClosed() const { return is_closed_; }
  double error_m() const { return error_m_; }  ///< of the mesh
  std::size_t turnedFaces() const { return turned_faces_; }
  std::size_t hiddenFaces() const { return hidden_faces_; }  ///< covered everywhere
  std::size_t cutFaces() const { return cut_faces_; }        ///< covered in part

 private:
  Effort* effort_;
  std::size_t parts_ = 0, turned_faces_ = 0, hidden_faces_ = 0, cut_faces_ = 0;
  bool is_closed_ = false;
  double error_m_ = 0;
  TriangleTree all_;
  TriangleMesh surface_mesh_;
  TriangleTree surface_;
};

}  // namespace hapticd::solids
