#pragma once

#include <cstdint>

#include "rt/parameters.h"
#include "rt/scene.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// What every force law computes from.
struct LawInput {
  const Scene& scene;
  Vec3 hip_m_in_world;                 ///< finite
  Vec3 hip_velocity_m_per_s_in_world;  ///< for damping only
  const LiveParameters& parameters;
};

/// Where a constraint law's proxy is.
enum class ContactState : std::uint8_t {
  free,        ///< the proxy is the HIP; always so in the laws without a proxy
  contact,     ///< the surface holds the proxy back from the HIP
  entrenched,  ///< a moving surface went over the proxy, and it is on its way out
};

/// True for the laws whose force is a spring to a proxy that a surface holds back.
constexpr bool hasProxy(ForceLaw law) noexcept {
  return law == ForceLaw::proxy || law == ForceLaw::surface;
}

/// How the law `proxy` looks at points; r1, r2 and r3 around the proxy.
struct ProxyRadii {
  double touch_m;   ///< r1: no point comes nearer
  double rest_m;    ///< r2: at rest on the surface the nearest point is between r1 and r2
  double search_m;  ///< r3: points that make up the surface that is felt
  double swept_m;   ///< how far a surface can have gone over the proxy between two frames

  static ProxyRadii of(const ContactParameters& parameters) noexcept {
    constexpr double kRest_m = 0.001;
    constexpr double kSearch_m =
        0.008;  // beyond the sensor's noise at 1 m, so that a stray point does not rule alone
    const double touch = parameters.proxy_radius_m;
    constexpr double kSwept_m = 0.04;  // 0.5 m/s for 50 ms, and a raw unit at 2 m
    return {touch, touch + kRest_m, touch + kSearch_m, kSwept_m};
  }
};

/// How far around its focus a law needs the scene modelled for one evaluation, metres.  RT: safe.
inline double reachOfLaw_m(const LiveParameters& parameters) noexcept {
  switch (parameters.law) {
    case ForceLaw::nearest_springs:
    case ForceLaw::smooth_springs:
      return parameters.springs.radius_m;
    case ForceLaw::proxy: {
      const ProxyRadii radii = ProxyRadii::of(parameters.contact);
      return radii.swept_m + radii.touch_m + radii.search_m;
    }
    case ForceLaw::surface:
      return 2 * parameters.surface.voxel_edge_m;
  }
  return 0;
}

/// What a force law computed.
struct ForceSample {
  Vec3 force_n_in_world{};
  std::uint32_t points_used =
      0;  ///< N of eq. (11), the points of a weighted mean, or 0 where none are looked at
  ContactState state = ContactState::free;
  Vec3 proxy_m_in_world{};  ///< the HIP in the laws without a proxy
  Vec3 normal_in_world{};   ///< of the surface in contact, a unit vector out of it; zero when free
  Vec3 surface_velocity_m_per_s_in_world{};  ///< of the surface in contact, where the law lets it move
                                             ///< between frames
  bool outside_model = false;  ///< the scene does not hold all that the force depends on; the force is zero
};

}  // namespace hapticd::rt
