// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/lib/solids/field/sampled_field.h"
#include "tools/lib/solids/field/triangle_tree.h"
#include "tools/lib/solids/files/mesh_repair.h"

namespace hapticd::solids {

/// A mesh that is ready for sampling: parts that are inside out are turned, and faces that lie inside the
/// body do not count as its surface. Immutable.
class MeshBody {
 public:
  /// `mesh`: repaired, with at least one triangle.
  explicit MeshBody(TriangleMesh mesh);

  const TriangleMesh& mesh() const { return mesh_; }
  const std::vector<std::uint32_t>& visible() const { return visible_; }  ///< faces that are the surface
  /// Whether the winding number is a whole number everywhere but for rounding and dipoles: each edge is run
  /// through as often in one direction as in the other.
  bool isClosed() const { return is_closed_; }
  std::size_t turnedFaces() const { return turned_faces_; }
  std::size_t hiddenFaces() const { return mesh_.triangles.size() - visible_.size(); }

  const TriangleTree& surface() const { return surface_; }  ///< of the visible faces
  double winding(const rt::Vec3& point_m) const { return all_.winding(point_m); }

 private:
  TriangleMesh mesh_;
  std::size_t turned_faces_ = 0;
  bool is_closed_ = false;
  TriangleTree all_;
  std::vector<std::uint32_t> visible_;
  TriangleTree surface_;
};

/// The winding numbers in the band, from which a person sees how clean a mesh is. Of a closed mesh only those
/// next to the surface are computed.
struct WindingRange {
  double lowest = 1, highest = 0;
  std::size_t samples = 0, unclear = 0;  ///< unclear: from 0.2 to 0.8
  double unclearest = 1;                 ///< least distance from 0.5
  rt::Vec3 unclearest_m;                 ///< where that is
  double unclearShare() const {
    return samples > 0 ? static_cast<double>(unclear) / static_cast<double>(samples) : 0;
  }
};

enum class FarSamples {
  exact_sign,  ///< distances to a triangle that may be any of those near: only for measuring near the surface
  nearly_exact,
};

/// Fills the values of a grid. They are exact within the band. Farther away the sign is right, and the
/// distance is one to a triangle that is the nearest of those of the neighbours.
WindingRange sampleMesh(const MeshBody& body, double band_m, SampledField& grid,
                        FarSamples far_samples = FarSamples::nearly_exact);

}  // namespace hapticd::solids
