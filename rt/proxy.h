#pragma once

#include "rt/contact.h"
#include "rt/force_law.h"
#include "rt/realtime_safe.h"

namespace hapticd::rt {

/// Proxy on the raw points, after Ryden and Chizeck (IEEE Trans. Haptics 6(3), 2013): a ball of radius r1
/// that no point may enter follows the HIP, and a spring of k_s pulls the HIP to it.
///
/// By the distance of the nearest point the proxy is free (above r2), in contact (r1 to r2: it slides along
/// the tangent plane) or entrenched (below r1: it is pushed out). A step is no longer than that distance less
/// r1, so it cannot go through points as long as they are not farther apart than r1. The normal is the mean
/// direction from the points within r3. A camera sees a surface from its free side only; so a proxy that was
/// in sight and is behind the surface of a new frame is brought back towards the camera, and an entrenched
/// one is pushed to the side that it came from. The force counts the HIP's depth below the mean plane of the
/// points, not below the ball. `input.scene` must have points and image; where it does not cover the proxy
/// the sample says so. RT: safe. Cost: kMaxProxyMoves searches of r3 at most.
ForceSample proxyForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT;

inline constexpr int kMaxProxyMoves = 10;

}  // namespace hapticd::rt
