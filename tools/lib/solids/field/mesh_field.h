// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "config/base/error.h"
#include "tools/lib/solids/field/mesh_body.h"
#include "tools/lib/solids/field/sampled_field.h"
#include "tools/lib/solids/files/mesh_repair.h"

namespace hapticd::solids {

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
