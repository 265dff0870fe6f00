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

/// What a force law computed.
struct ForceSample {
  Vec3 force_n_in_world{};
  std::uint32_t points_used =
      0;  ///< N of eq. (11), the points of a weighted mean, or 0 where none are looked at
  ContactState state = ContactState::free;
  Vec3 proxy_m_in_world{};     ///< the HIP in the laws without a proxy
  Vec3 normal_in_world{};      ///< of the surface in contact, a unit vector out of it; zero when free
  bool outside_model = false;  ///< the scene does not hold all that the force depends on; the force is zero
};

}  // namespace hapticd::rt
