// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt/laws/contact.h"
#include "rt/laws/force_blend.h"
#include "rt/laws/surface_field.h"

namespace hapticd::rt {

/// Tells a surface that moves from another one that comes in front of it, by what was last seen at the proxy.
/// Thread: one.  RT: safe.
class SurfaceSight {
 public:
  /// `proxy` as the last tick left it, and kept up by remember(). `frame_time_ns`: of the scene's frame.
  /// `hip_velocity_m_per_s`: in the camera's frame.
  SurfaceSight(ProxyMemory& proxy, const SurfaceField& field, const Vec3& hip_velocity_m_per_s,
               std::int64_t frame_time_ns) noexcept
      : contact_(proxy.surface),
        field_(field),
        hip_velocity_(hip_velocity_m_per_s),
        was_placed_(proxy.placed),
        is_free_(proxy.normal_in_world == Vec3{}),
        passed_over_(proxy.surface.passed_over),
        frame_time_ns_(frame_time_ns) {}

  /// Returns whether two normals differ by more than those of one smooth surface nearby.
  static bool isSharpTurn(const Vec3& normal, const Vec3& other) noexcept {
    constexpr double kTurn_cos = 0.82;  // 35 degrees
    return dot(normal, other) < kTurn_cos;
  }

  /// Returns whether a place's ray meets a surface with that normal at more than 60 degrees from it.
  static bool isSteep(const Vec3& normal, const Vec3& place_m) noexcept {
    constexpr double kSteep_cos = 0.5;
    return -dot(normal, place_m) < kSteep_cos * norm(place_m);
  }

  /// Returns the largest change of depth that the motion of a surface explains since it was last seen at the
  /// proxy.
  double largestMove_m(const SurfaceLook& at) const noexcept {
    const double since_s = static_cast<double>(frame_time_ns_ - contact_.surface_ns) * 1e-9;
    const double seconds = passed_over_ ? kFrame_s : std::clamp(since_s, kFrame_s, kLongestGap_s);
    return kFastestArrival_m_per_s * seconds + field_.noise_m(at.place_m);
  }

  /// Returns whether the proxy is in a body that was not in front of it before, and came faster than a
  /// surface does, or, if the proxy is free, came from the side: its outline has moved over the proxy, by
  /// more than the hand moves in a frame and an outline flickers. How thick it is cannot be seen.
  bool cameByJump(const SurfaceLook& at) const noexcept {
    const bool inside = at.isIn(SurfaceView::Where::inside) || (at.at_side && at.room_m < 0);
    if (!inside) return false;
    constexpr double kFlicker_px = 1;
    const double by_hand_m = -dot(hip_velocity_, at.normal) * kFrame_s;
    const bool nothing_seen = !(contact_.surface_depth_m > 0);
    // Where nothing was seen, a front may have moved here from anywhere; an outline came over the proxy
    // unless the hand came to it.
    if (nothing_seen) return is_free_ && was_placed_ && at.at_side && -at.room_m > std::max(0.0, by_hand_m);
    const double flicker_m = kFlicker_px * field_.pitch_m(at.place_m);
    if (is_free_ && at.at_side && -at.room_m < std::min(by_hand_m, flicker_m)) return false;
    const double came_m = contact_.surface_depth_m - at.sheet.depth_m();
    if (came_m > largestMove_m(at)) return true;
    if (!is_free_) return false;
    // Next to an outline, a front that came so fast more likely came from the side; facets round off the
    // step.
    constexpr double kBesideOutline = 0.5;
    if (came_m > kBesideOutline * largestMove_m(at) && field_.isNearOutline(at.place_m)) return true;
    return isSteep(at.sheet.normal_in_camera, at.place_m) &&
           isSharpTurn(at.sheet.normal_in_camera, contact_.surface_normal_in_camera);
  }

  /// Returns whether the front of a body is that far over the proxy although it did not come that much nearer
  /// to the camera: its outline has moved over the proxy.
  bool cameFromTheSide(const SurfaceLook& at) const noexcept {
    const double came_m = std::max(0.0, contact_.surface_depth_m - at.sheet.depth_m());
    return at.sheet.exists && !at.at_side && -at.room_m > came_m + 2 * field_.noise_m(at.place_m);
  }

  /// Remembers the surface at the proxy.
  void remember(const SurfaceLook& at, bool in_contact) noexcept {
    const Sheet& sheet = in_contact ? at.sheet : at.own.sheet;
    if (at.isIn(SurfaceView::Where::inside) && !in_contact) return;
    if (sheet.exists) {
      contact_.surface_depth_m = sheet.depth_m();
      contact_.surface_normal_in_camera = sheet.normal_in_camera;
    } else if (at.isIn(SurfaceView::Where::unseen) && !in_contact) {
      // Whatever it is in next comes from behind.
      contact_.surface_depth_m = std::numeric_limits<double>::infinity();
    } else {
      return;
    }
    contact_.surface_ns = frame_time_ns_;
  }

 private:
  /// Twice the speed of the fastest surface that a hand should follow.
  static constexpr double kFastestArrival_m_per_s = 2 * kFastestSurface_m_per_s;
  /// Usual time between frames, and the longest over which a surface is compared.
  static constexpr double kFrame_s = 1.0 / 30;
  static constexpr double kLongestGap_s = 1.0 / 3;

  SurfaceContact& contact_;
  const SurfaceField& field_;
  Vec3 hip_velocity_;
  bool was_placed_;
  bool is_free_;
  bool passed_over_;
  std::int64_t frame_time_ns_;
};

}  // namespace hapticd::rt
