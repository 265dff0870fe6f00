// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/contact.h"
#include "rt/force_law.h"
#include "rt/realtime_safe.h"

namespace hapticd::rt {

/// Proxy on the raw points: it follows the HIP, held back by planes that are fitted to the points around it
/// (proxy_patch.h), and a spring of k_s pulls the HIP to it. After Ryden and Chizeck (IEEE Trans. Haptics
/// 6(3), 2013), with planes in place of their ball, which stuck between points.
///
/// Free, the proxy goes to the HIP in steps that cannot pass a surface unseen. Where the HIP is below the
/// plane next to the proxy it slides along that plane by all that friction leaves, and onto it; nothing else
/// stops a slide. It lets go where the surface ends, a pixel beyond the last point. A camera sees a surface
/// from its free side only: a proxy that comes to the far side around an edge is `behind` and feels nothing,
/// and one that a new frame's surface went over is brought back towards the camera. What is farther in front
/// than that hides it, and the scene's points hold what is hidden (OcclusionMemory). `input.scene` must have
/// points and image; where it does not cover the proxy the sample says so. A contact whose surface has come
/// too near to be measured is held. RT: safe. Cost: kMaxProxyMoves patches at most, mostly one.
ForceSample proxyForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT;

inline constexpr int kMaxProxyMoves = 10;

}  // namespace hapticd::rt
