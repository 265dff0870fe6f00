// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/realtime_safe.h"
#include "rt/laws/contact.h"
#include "rt/laws/force_law.h"

namespace hapticd::rt {

/// Computes the force of the law `surface`: a proxy constrained by the visible surface of the scene follows
/// the HIP, sliding along the surface, and a spring of k_s pulls the HIP towards it (god-object: Zilles and
/// Salisbury 1995; on implicit surfaces: Salisbury and Tarr 1997). The surface is the zero of one signed
/// distance (SurfaceField), which includes the sides that begin at outlines; the proxy goes down the distance
/// from the HIP over places outside of it and never jumps, so it stays on the side that the HIP came through.
/// A surface that moves over the proxy carries it along. What lies behind the surface is unknown: a HIP that
/// is inside a solid without having come through its surface gets no force until it is out again.
///
/// What comes in front of the proxy faster than a surface moves, or sideways, hides the proxy and does not
/// move it. Where something else comes to hold the proxy, or nothing, the force changes at a bounded rate.
///
/// `input.scene` must have the visible surface; where that does not cover the proxy, `outside_model` is set.
/// RT: safe.  Cost: bounded, at most 24 look-ups of the distance; one or two where the HIP moves little.
ForceSample surfaceForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT;

}  // namespace hapticd::rt
