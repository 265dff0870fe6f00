// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt/laws/contact.h"
#include "rt/laws/force_blend.h"
#include "rt/laws/surface_probe.h"

namespace hapticd::rt {

/// Tells a surface that moves from another one that comes in front of it, by what was last seen at the proxy.
/// Thread: one.  RT: safe.
class SurfaceSight {
 public:
  /// `proxy` as the last tick left it, and kept up by remember(). `frame_time_ns`: of the scene's frame.
  SurfaceSight(ProxyMemory& proxy, std::int64_t frame_time_ns) noexcept
      : contact_(proxy.surface),
        is_free_(proxy.normal_in_world == Vec3{}),
        passed_over_(proxy.surface.passed_over),
        frame_time_ns_(frame_time_ns) {}

  /// Returns the largest change of depth that the motion of a surface explains since it was last seen at the
  /// proxy.
  double largestMove_m(const SurfaceProbe& probe) const noexcept {
    const double since_s = static_cast<double>(frame_time_ns_ - contact_.surface_ns) * 1e-9;
    const double seconds = passed_over_ ? kFrame_s : std::clamp(since_s, kFrame_s, kLongestGap_s);
    return kFastestArrival_m_per_s * seconds + probe.noise_m();
  }

  /// Returns whether the proxy is in a body that was not in front of it before, and came faster than a
  /// surface does, or, if the proxy is free, came from the side: its outline has moved over the proxy. How
  /// thick it is cannot be seen.
  bool cameByJump(const SurfaceProbe& probe) const noexcept {
    const SurfaceProbe::Place& place = probe.at;
    if (place.where != SurfaceProbe::Where::inside || !(contact_.surface_depth_m > 0)) return false;
    if (contact_.surface_depth_m - place.sheet.depth_m() > largestMove_m(probe)) return true;
    return is_free_ && isSteep(place.sheet.normal_in_camera, probe, kSteep_cos) && turned(probe);
  }

  /// Returns whether a free proxy, next to the slope of an outline, is in the front that ends there: the
  /// outline has flickered over it. A surface that comes on moves by less.
  bool outlineCameOver(const SurfaceProbe& probe) const noexcept {
    constexpr double kNoises = 1.5;
    const double off_m = std::abs(contact_.surface_depth_m - SurfaceView::depthOf(probe.p));
    return is_free_ && probe.at.where == SurfaceProbe::Where::inside && off_m < probe.noise_m() &&
           probe.at.distance_m < -kNoises * probe.noise_m() && turned(probe) &&
           isSteep(contact_.surface_normal_in_camera, probe, kSlanted_cos);
  }

  /// Remembers the surface at the proxy.
  void remember(const SurfaceProbe& probe, bool in_contact) noexcept {
    if (probe.at.where == SurfaceProbe::Where::inside) return;
    if (probe.at.sheet.exists) {
      contact_.surface_depth_m = probe.at.sheet.depth_m();
      contact_.surface_normal_in_camera = probe.at.sheet.normal_in_camera;
    } else if (probe.at.where == SurfaceProbe::Where::unseen && !in_contact) {
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

  static constexpr double kSteep_cos = 0.5;    // 60 degrees
  static constexpr double kSlanted_cos = 0.8;  // 37 degrees: noise widens an outline to a slope
  /// Returns whether a surface with this normal is steeper relative to the ray than an angle.
  static bool isSteep(const Vec3& normal, const SurfaceProbe& probe, double cosine) noexcept {
    return -dot(normal, probe.p) < cosine * norm(probe.p);
  }

  /// Returns whether the surface at the proxy has another direction than the last one there.
  bool turned(const SurfaceProbe& probe) const noexcept {
    return SurfaceProbe::isSharpTurn(probe.at.sheet.normal_in_camera, contact_.surface_normal_in_camera);
  }

  SurfaceContact& contact_;
  bool is_free_;
  bool passed_over_;
  std::int64_t frame_time_ns_;
};

}  // namespace hapticd::rt
