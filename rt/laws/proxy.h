// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/laws/contact.h"
#include "rt/laws/force_law.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {

/// Size of the piece of surface that the law `proxy` treats as a plane, at a given distance from the camera.
///
/// The sensor's noise is correlated over about 9 px, so a patch must be larger than that to determine its
/// tilt. Large patches are used where the points are flat up to noise, small ones elsewhere.
struct PatchSizes {
  double pitch_m;  ///< distance between the rays of adjacent pixels
  double noise_m;  ///< standard deviation of the sensor's noise along the optical axis
  double small_radius_m;
  double large_radius_m;

  /// Returns the sizes at depth `depth_m`. `min_radius_m`: radius where pixels are dense; `max_radius_m`:
  /// radius within which points are modelled around the place.  RT: safe.
  static PatchSizes at(const DepthModel& model, double depth_m, double min_radius_m,
                       double max_radius_m) noexcept;
};

/// The piece of surface next to a place, approximated by a plane.
struct Patch {
  std::uint32_t points = 0;  ///< number of points around the place
  double nearest_m = 0;      ///< distance of the nearest one; the larger radius if there are none
  bool exists = false;       ///< there are enough points for a plane
  Vec3 normal;               ///< unit vector towards the camera's side
  double height_m = 0;       ///< of the place above the plane, along the normal
  bool supported = false;    ///< the surface extends to the foot of the place, within a pixel
};

/// Fits the patch around `place_m_in_world`. `side_in_world`: approximate unit normal of the surface.
/// `band_m`: points farther from the plane through the place with this normal belong to something else.
/// RT: safe.  Cost: at most two passes over the points within sizes.large_radius_m.
Patch patchAt(const Scene& scene, const Vec3& place_m_in_world, const Vec3& side_in_world,
              const PatchSizes& sizes, double band_m) HAPTICD_RT;

/// Computes the force of the law `proxy`: the proxy follows the HIP, constrained by planes fitted to the raw
/// points around it (proxy.h), and a spring of k_s pulls the HIP towards it. After Ryden and Chizeck
/// (IEEE Trans. Haptics 6(3), 2013), with planes in place of their ball, which got stuck between points.
///
/// A free proxy moves to the HIP in steps that cannot pass through a surface. Where the HIP is below the
/// plane next to the proxy, the proxy slides along that plane, as far as friction allows, and onto it. The
/// surface releases it one pixel beyond the last point. A camera sees a surface only from its free side: a
/// proxy that reaches the far side around an edge is `behind` and exerts no force, and one that a surface of
/// a new frame has passed over is brought back towards the camera. A body farther in front hides the surface;
/// the scene's points include what is hidden (OcclusionMemory). A contact whose surface has come too near to
/// be measured is held.
///
/// `input.scene` must have points and image; where it does not cover the proxy, `outside_model` is set.
/// RT: safe.  Cost: at most kMaxProxyMoves patches, usually one.
ForceSample proxyForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT;

/// Largest number of patches that one evaluation of the law `proxy` fits.
inline constexpr int kMaxProxyMoves = 10;

}  // namespace hapticd::rt
