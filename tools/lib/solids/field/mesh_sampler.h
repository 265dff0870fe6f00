// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "tools/lib/solids/field/mesh_body.h"
#include "tools/lib/solids/field/sampled_field.h"

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

}  // namespace hapticd::solids
