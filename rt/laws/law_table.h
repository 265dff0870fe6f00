// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/words.h"
#include "rt/laws/force_law.h"
#include "rt/laws/force_laws.h"
#include "rt/laws/proxy.h"
#include "rt/laws/smooth_springs.h"
#include "rt/laws/surface.h"

/// The table of force laws: each row holds all that the rest of the program needs to know about a law.
namespace hapticd::rt {

/// The force laws.
enum class ForceLaw : std::uint8_t {
  nearest_springs,  ///< the paper's: mean of the springs of the nearest points
  smooth_springs,   ///< weighted mean of the springs of all near points, continuous in position
  proxy,            ///< spring to a proxy that planes fitted to the raw points hold back
  surface,          ///< spring to a proxy that the visible surface holds back
};
constexpr auto wordsOf(ForceLaw) {
  return words<ForceLaw>("nearest_springs", "smooth_springs", "proxy", "surface");
}

struct ForceLawRow {
  ForceLaw law;
  std::string_view help;           ///< one line for users: what the force is, without a full stop
  bool reads_points;               ///< needs the scene's points
  bool reads_image;                ///< needs the raw values that the points come from, and what they hide
  bool reads_surface;              ///< needs the scene's visible surface
  bool reads_filtered;             ///< its depth passes the filter of FilterParameters
  bool has_proxy;                  ///< the force is a spring to a proxy that a surface holds back
  bool looks_in_radius;            ///< reach_m is SpringParameters::radius_m
  bool limits_points = false;      ///< only the nearest SpringParameters::max_points count
  bool carries_standoffs = false;  ///< it has the surface that stand-off fixtures keep their clearance from
  bool suits_every_scene = false;  ///< what `auto` takes until the scene is known
  /// Radius around its focus within which one evaluation needs the scene, in metres.  RT: safe.
  double (*reach_m)(const LiveParameters& parameters) noexcept;
  /// Returns the force at `input.hip_m_in_world`; the scene must hold the data that the law reads.  RT: safe.
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
        .limits_points = true,
        .reach_m = [](const LiveParameters& parameters) noexcept { return parameters.force.radius_m; },
        .force = [](const LawInput& input, LawMemory& memory) HAPTICD_RT -> ForceSample {
          SpringParameters springs = input.parameters.force;
          springs.stiffness_n_per_m = input.stiffness_n_per_m;
          ForceSample sample = nearestSprings(input.scene, input.hip_m_in_world, springs, memory.search);
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
        .reach_m = [](const LiveParameters& parameters) noexcept { return parameters.force.radius_m; },
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
        .carries_standoffs = true,
        .suits_every_scene = true,
        .reach_m =
            [](const LiveParameters& parameters) noexcept {
              return kReachOfSurface_m + parameters.standoff_clearance_m;
            },
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

/// Returns the row of `law`, which must be an enumerator.  RT: safe.
constexpr const ForceLawRow& rowOf(ForceLaw law) noexcept {
  return kForceLaws[static_cast<std::size_t>(law)];
}

/// Returns true for laws whose force is a spring to a proxy that a surface holds back.  RT: safe.
constexpr bool hasProxy(ForceLaw law) noexcept {
  return rowOf(law).has_proxy;
}

/// Returns the first law that has a property, or the first law of all.  RT: safe.
constexpr ForceLaw lawThat(bool ForceLawRow::*property) noexcept {
  for (const ForceLawRow& row : kForceLaws) {
    if (row.*property) return row.law;
  }
  return {};
}

}  // namespace hapticd::rt
