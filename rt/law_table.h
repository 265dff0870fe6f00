// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "rt/enumeration.h"
#include "rt/force_law.h"
#include "rt/law_memory.h"
#include "rt/parameters.h"
#include "rt/proxy.h"
#include "rt/realtime_safe.h"
#include "rt/smooth_springs.h"
#include "rt/surface.h"

/// The force laws: one row for each, which holds all that the rest of the program has to know of it.
namespace hapticd::rt {

struct ForceLawRow {
  ForceLaw law;
  std::string_view help;  ///< one line for users: what the force is, without a full stop
  bool reads_points;      ///< needs the scene's points
  bool reads_image;       ///< needs the depth image that the points were made from, and what it hides
  bool reads_surface;     ///< needs the scene's visible surface
  bool reads_filtered;    ///< its depth passes the filter of FilterParameters
  bool has_proxy;         ///< the force is a spring to a proxy that a surface holds back
  bool looks_in_radius;   ///< reach_m is SpringParameters::radius_m
  /// How far around its focus it needs the scene modelled for one evaluation, metres.  RT: safe.
  double (*reach_m)(const LiveParameters& parameters) noexcept;
  /// The force at `input.hip_m_in_world`, where the scene holds what the law reads.  RT: safe.
  ForceSample (*force)(const LawInput& input, LawMemory& memory) HAPTICD_RT;
};

inline constexpr std::array kForceLaws{
    ForceLawRow{
        .law = ForceLaw::nearest_springs,
        .help = "mean of the springs of the nearest points, eq. (6) to (11) of the paper; pulls behind the "
                "surface",
        .reads_points = true,
        .reads_image = false,
        .reads_surface = false,
        .reads_filtered = true,
        .has_proxy = false,
        .looks_in_radius = true,
        .reach_m = [](const LiveParameters& parameters) noexcept { return parameters.springs.radius_m; },
        .force = [](const LawInput& input, LawMemory& memory) HAPTICD_RT -> ForceSample {
          ForceSample sample =
              nearestSprings(input.scene, input.hip_m_in_world, input.parameters.springs, memory.search);
          sample.proxy_m_in_world = input.hip_m_in_world;
          return sample;
        }},
    ForceLawRow{
        .law = ForceLaw::smooth_springs,
        .help = "weighted mean of the springs of all points within the radius, continuous; pulls behind the "
                "surface",
        .reads_points = true,
        .reads_image = false,
        .reads_surface = false,
        .reads_filtered = true,
        .has_proxy = false,
        .looks_in_radius = true,
        .reach_m = [](const LiveParameters& parameters) noexcept { return parameters.springs.radius_m; },
        .force = [](const LawInput& input, LawMemory& memory)
                     HAPTICD_RT { return smoothSprings(input, memory.search); }},
    ForceLawRow{
        .law = ForceLaw::proxy,
        .help = "spring to a proxy that planes fitted to the raw points hold back",
        .reads_points = true,
        .reads_image = true,
        .reads_surface = false,
        .reads_filtered = true,
        .has_proxy = true,
        .looks_in_radius = false,
        .reach_m =
            [](const LiveParameters& parameters) noexcept { return reachOfProxy_m(parameters.contact); },
        .force = [](const LawInput& input, LawMemory& memory)
                     HAPTICD_RT { return proxyForce(input, memory.proxy); }},
    ForceLawRow{
        .law = ForceLaw::surface,
        .help = "spring to a proxy that the visible surface, fitted over pixels and frames, holds back",
        .reads_points = false,
        .reads_image = false,
        .reads_surface = true,
        .reads_filtered = false,
        .has_proxy = true,
        .looks_in_radius = false,
        .reach_m = [](const LiveParameters&) noexcept { return kReachOfSurface_m; },
        .force = [](const LawInput& input, LawMemory& memory)
                     HAPTICD_RT { return surfaceForce(input, memory.proxy); }},
};

static_assert(kForceLaws.size() == enumeratorCount<ForceLaw>(), "each force law needs a row");
static_assert(
    [] {
      for (std::size_t row = 0; row < kForceLaws.size(); ++row) {
        if (kForceLaws[row].law != static_cast<ForceLaw>(row)) return false;
      }
      return true;
    }(),
    "rows stand in the order of ForceLaw");

/// `law` is an enumerator: what comes from outside is checked where it enters.  RT: safe.
constexpr const ForceLawRow& rowOf(ForceLaw law) noexcept {
  return kForceLaws[static_cast<std::size_t>(law)];
}

/// True for the laws whose force is a spring to a proxy that a surface holds back.  RT: safe.
constexpr bool hasProxy(ForceLaw law) noexcept {
  return rowOf(law).has_proxy;
}

/// How far around its focus the law in `parameters` needs the scene modelled for one evaluation, metres.
/// RT: safe.
inline double reachOfLaw_m(const LiveParameters& parameters) noexcept {
  return rowOf(parameters.law).reach_m(parameters);
}

}  // namespace hapticd::rt
