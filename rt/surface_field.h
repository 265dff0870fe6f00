#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Value and gradient of a field at one place.
struct FieldSample {
  double distance_m;       ///< positive in front of the surface, negative behind
  Vec3 gradient_in_world;  ///< points out of the surface; of length 1 on a plane
};

/// Signed distances to the visible surface on the corners ("nodes") of cubic voxels, axis-aligned in the
/// world; the nodes lie on whole multiples of the voxel edge, so the window's place does not change their
/// values. Free space in front of what the camera sees is positive, the unknown behind it negative, a ray on
/// which nothing is seen is free. Distances are cut off at `truncation_m`. A view; a SceneStorage owns the
/// memory. Immutable once published.
struct SurfaceField {
  static constexpr int kNodesPerAxis = 32;
  static constexpr std::size_t kNodes = std::size_t{kNodesPerAxis} * kNodesPerAxis * kNodesPerAxis;
  static constexpr double kTruncation_voxels = 4;
  /// A surface that went over the proxy between two frames must be found again: 0.5 m/s, one frame lost.
  static constexpr double kLeastTruncation_m = 0.035;
  /// The nodes that a sample reads lie within that many voxel edges of it: two along each axis.
  static constexpr double kStencil_voxels = 3.4642;

  double voxel_edge_m = 0;  ///< 0: there is no field
  Vec3 origin_m_in_world;   ///< of node (0, 0, 0)
  Vec3 centre_m_in_world;   ///< samples may be taken within `radius_m` of it
  double radius_m = 0;
  float* distance_m = nullptr;  ///< [kNodes], x fastest

  double truncation_m() const noexcept {
    return std::max(kTruncation_voxels * voxel_edge_m, kLeastTruncation_m);
  }

  /// True if sampleField() may be asked for all places within `radius` of `p`.  RT: safe.
  bool covers(const Vec3& p_m_in_world, double radius) const noexcept {
    return voxel_edge_m > 0 && norm(p_m_in_world - centre_m_in_world) + radius <= radius_m;
  }
};
static_assert(std::is_trivially_copyable_v<SurfaceField>);

/// The field at a place that it covers. The gradient is that of central differences at the nodes,
/// interpolated linearly, so both are continuous everywhere; the value is exact for fields that are quadratic
/// in the position. RT: safe. Cost: constant, 64 nodes at most.
FieldSample sampleField(const SurfaceField& field, const Vec3& p_m_in_world) HAPTICD_RT;

}  // namespace hapticd::rt
