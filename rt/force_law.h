// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "rt/parameters.h"
#include "rt/scene.h"
#include "rt/vec3.h"
#include "rt/words.h"

namespace hapticd::rt {

/// A surface that moves is carried forward for no longer than that: an older motion says little of where the
/// surface is.
inline constexpr double kLongestPrediction_s = 0.1;

/// How long before `now_ns` (the clock of Scene::frame_time_ns) the camera saw what the scene shows: the age
/// of the frame since its arrival and the camera's latency, 0..kLongestPrediction_s.  RT: safe.
inline double frameAge_s(const Scene& scene, std::int64_t now_ns, const LiveParameters& parameters) noexcept {
  if (scene.frame == 0) return 0;
  const double since_arrival_s = static_cast<double>(now_ns - scene.frame_time_ns) * 1e-9;
  return std::clamp(since_arrival_s + parameters.camera.latency_s, 0.0, kLongestPrediction_s);
}

/// What every force law computes from.
struct LawInput {
  const Scene& scene;
  Vec3 hip_m_in_world;                 ///< finite
  Vec3 hip_velocity_m_per_s_in_world;  ///< for damping only
  const LiveParameters& parameters;
  double frame_age_s = 0;  ///< from what the frame shows to this tick, 0..kLongestPrediction_s
};

/// Where a constraint law's proxy is.
enum class ContactState : std::uint8_t {
  free,        ///< the proxy is the HIP; always so in the laws without a proxy
  contact,     ///< the surface holds the proxy back from the HIP
  entrenched,  ///< a moving surface went over the proxy, and it is on its way out
  behind,      ///< behind what the camera sees, without having come through it: nothing is exerted
};
constexpr auto wordsOf(ContactState) {
  return words<ContactState>("free", "contact", "entrenched", "behind");
}

/// True where a surface holds the proxy back, or is still to let go of it.
constexpr bool isHeld(ContactState state) noexcept {
  return state == ContactState::contact || state == ContactState::entrenched;
}

/// How far the law `proxy` looks at points around the proxy, and how far a surface can have come over it.
struct ProxyRadii {
  double least_m;  ///< of the surface that is taken for a plane, where pixels are dense
  double most_m;   ///< likewise, where they are far apart
  double swept_m;  ///< how far a surface can have gone over the proxy between two frames

  static ProxyRadii of(const ContactParameters& parameters) noexcept {
    constexpr double kMost_m = 0.06;
    constexpr double kSwept_m = 0.04;  // 0.5 m/s for 50 ms, and a raw unit at 2 m
    return {parameters.proxy_radius_m, std::max(kMost_m, parameters.proxy_radius_m), kSwept_m};
  }
};

/// How far from its proxy the law `surface` looks at the surface in one evaluation.
inline constexpr double kReachOfSurface_m = 0.012;

/// How far around its proxy the law `proxy` needs the scene modelled for one evaluation, metres.  RT: safe.
inline double reachOfProxy_m(const ContactParameters& parameters) noexcept {
  constexpr double kAhead_m = 0.004;  // the next scene is built before the proxy reaches the end of this one
  return ProxyRadii::of(parameters).most_m + kAhead_m;
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
  bool too_near = false;  ///< the surface in contact has come nearer than the camera can measure; the force
                          ///< is that of where it was seen last
};

}  // namespace hapticd::rt
