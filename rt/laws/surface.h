// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/realtime_safe.h"
#include "rt/laws/contact.h"
#include "rt/laws/force_law.h"

namespace hapticd::rt {

/// Computes the force of the law `surface`: a proxy constrained by the visible surface of the scene follows
/// the HIP, sliding along the surface, and a spring of k_s pulls the HIP towards it (god-object: Zilles and
/// Salisbury 1995; on implicit surfaces: Salisbury and Tarr 1997). A surface that moves over the proxy
/// carries it along. What lies behind the surface is unknown: a HIP that is inside a solid without having
/// come through its surface gets no force until it is out again.
///
/// A HIP that crosses the outline of a body comes through its side, which holds it until the front is nearer.
/// What comes in front of the proxy faster than a surface moves, or sideways, hides the proxy and does not
/// move it. Where something else comes to hold the proxy, or nothing, the force changes at a bounded rate.
///
/// `input.scene` must have the visible surface; where that does not cover the proxy, `outside_model` is set.
/// RT: safe.  Cost: constant, at most kMaxSurfaceSamples look-ups of the surface.
ForceSample surfaceForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT;

/// Largest number of places that one evaluation of the law `surface` looks up.
inline constexpr int kMaxSurfaceSamples = 20;

}  // namespace hapticd::rt
