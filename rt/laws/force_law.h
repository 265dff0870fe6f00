// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {

/// Longest time for which a moving surface is extrapolated; beyond it, its velocity does not predict its
/// place.
inline constexpr double kMaxPrediction_s = 0.1;

/// Returns how long before `now_ns` (same clock as Scene::frame_time_ns) the camera saw what the scene shows:
/// the time since its exposure, or since the arrival plus the camera's latency where it is not known, clamped
/// to 0..kMaxPrediction_s.  RT: safe.
inline double frameAge_s(const Scene& scene, std::int64_t now_ns, double camera_latency_s) noexcept {
  if (scene.frame == 0) return 0;
  const auto since_s = [now_ns](std::int64_t then_ns) {
    return static_cast<double>(now_ns - then_ns) * 1e-9;
  };
  if (scene.exposure_ns != 0) return std::clamp(since_s(scene.exposure_ns), 0.0, kMaxPrediction_s);
  const double since_arrival_s = since_s(scene.frame_time_ns);
  return std::clamp(since_arrival_s + camera_latency_s, 0.0, kMaxPrediction_s);
}

/// Input of every force law.
struct LawInput {
  const Scene& scene;
  Vec3 hip_m_in_world;                 ///< finite
  Vec3 hip_velocity_m_per_s_in_world;  ///< for damping only
  const LiveParameters& parameters;
  double stiffness_n_per_m;  ///< k_s in effect: that of `parameters`, or the automatic one
  double friction;           ///< in effect: that of `parameters`, or of the tissue at the proxy
  double frame_age_s = 0;    ///< time from what the frame shows to this tick, 0..kMaxPrediction_s
  double period_s = 0.001;   ///< time since the previous tick, > 0
};

/// Position of a constraint law's proxy relative to the surface.
enum class ContactState : std::uint8_t {
  free,        ///< the proxy is the HIP; always so in the laws without a proxy
  contact,     ///< the surface holds the proxy back from the HIP
  entrenched,  ///< a moving surface has passed over the proxy, which is on its way out
  behind,      ///< behind what the camera sees, without having come through it: no force
};
constexpr auto wordsOf(ContactState) {
  return words<ContactState>("free", "contact", "entrenched", "behind");
}

/// Returns true if a surface holds the proxy or has not released it yet.
constexpr bool isHeld(ContactState state) noexcept {
  return state == ContactState::contact || state == ContactState::entrenched;
}

/// Distances around the proxy of the law `proxy`: of the points that it fits, and of a surface passing over
/// it.
struct ProxyRadii {
  double least_m;  ///< radius of the patch treated as a plane where pixels are dense
  double most_m;   ///< the same where pixels are far apart
  double swept_m;  ///< largest displacement of a surface over the proxy between two frames

  static ProxyRadii of(const ContactParameters& parameters) noexcept {
    constexpr double kMaxReach_m = 0.06;
    constexpr double kSwept_m = 0.04;  // 0.5 m/s for 50 ms, and a raw unit at 2 m
    return {parameters.proxy_radius_m, std::max(kMaxReach_m, parameters.proxy_radius_m), kSwept_m};
  }
};

/// Distance from its proxy up to which the law `surface` examines the surface in one evaluation.
inline constexpr double kReachOfSurface_m = 0.012;

/// Returns the radius around its proxy, in metres, within which the law `proxy` needs the scene.  RT: safe.
inline double reachOfProxy_m(const ContactParameters& parameters) noexcept {
  constexpr double kAhead_m = 0.004;  // the next scene is built before the proxy reaches the end of this one
  return ProxyRadii::of(parameters).most_m + kAhead_m;
}

/// Result of a force law.
struct ForceSample {
  Vec3 force_n_in_world{};
  std::uint32_t points_used =
      0;  ///< N of eq. (11), the points of a weighted mean, or 0 for a law that uses none
  ContactState state = ContactState::free;
  Vec3 proxy_m_in_world{};  ///< the HIP for the laws without a proxy
  Vec3 normal_in_world{};   ///< unit normal out of the surface in contact; zero when free
  /// Velocity of the surface in contact, if the law extrapolates it between frames.
  Vec3 surface_velocity_m_per_s_in_world{};
  bool outside_model = false;  ///< the scene does not cover all that the force depends on; the force is zero
  /// The surface in contact has come nearer than the camera can measure; the force is based on its last seen
  /// position.
  bool too_near = false;
  double depth_m = 0;  ///< laws with a proxy: depth of the HIP below the surface in contact, >= 0
};

}  // namespace hapticd::rt
