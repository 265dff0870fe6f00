// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/base/error.h"
#include "tools/lib/solids/field/field_options.h"
#include "tools/lib/solids/field/mesh_sampler.h"
#include "tools/lib/solids/files/mesh_repair.h"

namespace hapticd::solids {

/// The signed distance to a mesh.
struct MeshField {
  SampledField field;
  FieldReport report;
  WindingRange winding;               ///< in the band
  std::size_t turned_faces = 0;       ///< of parts that were inside out
  std::size_t hidden_faces = 0;       ///< that other parts cover, and so are not the surface
  std::size_t cut_faces = 0;          ///< that other parts cover in part
  std::optional<ThinPlace> thinnest;  ///< where opposite faces are nearest to each other
};

/// Largest share of unclear winding numbers in the band.
inline constexpr double kMaxUnclearShare = 0.005;

/// Samples the signed distance to a mesh so finely that the consumer's value is off by at most the tolerance
/// at the points, the middles of the edges and the centres of the faces, where it is measured. Inside is
/// where the generalised winding number is above 1/2; faces may be missing, turned or cross each other.
/// `name`: of the mesh, for messages. Thread: any; takes seconds. RT: not safe. Errors: an option out of
/// range; holes so wide that what is inside is unclear, with the place; nothing inside; the tolerance would
/// take more samples than the limits allow, with one that would fit.
base::Result<MeshField> fieldOfMesh(TriangleMesh mesh, const std::string& name,
                                    const FieldOptions& options = {});

}  // namespace hapticd::solids
