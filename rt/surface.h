// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/contact.h"
#include "rt/force_law.h"
#include "rt/realtime_safe.h"

namespace hapticd::rt {

/// Constraint on the signed distance field of the scene: a proxy that the surface does not let through
/// follows the HIP, sliding along the surface, and a spring of k_s pulls the HIP to it (god-object: Zilles
/// and Salisbury 1995; on implicit surfaces: Salisbury and Tarr 1997). A surface that moved over the proxy
/// carries it along. What lies behind the surface is unknown: a HIP that is deeper in it than the field
/// reaches, without having come through the surface, feels nothing until it is out again. `input.scene` must
/// have the field; where the field does not cover the proxy the sample says so. RT: safe. Cost: constant, at
/// most kMaxSurfaceSamples samples of the field.
ForceSample surfaceForce(const LawInput& input, ProxyMemory& proxy) HAPTICD_RT;

inline constexpr int kMaxSurfaceSamples = 48;

}  // namespace hapticd::rt
