// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/realtime_safe.h"
#include "rt/laws/contact.h"
#include "rt/laws/force_law.h"

namespace hapticd::rt {

/// Computes the force of the law `proxy`: the proxy follows the HIP, constrained by planes fitted to the raw
/// points around it (proxy_patch.h), and a spring of k_s pulls the HIP towards it. After Ryden and Chizeck
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
