// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/laws/surface_probe.h"

namespace hapticd::rt {

/// Contact with the side of a body. The camera does not see it; it is assumed to extend straight back from
/// the outline in the image, as deep as the body's shell. The HIP came to it through free space, and the side
/// holds it until the HIP has left it or the front is nearer.
/// Thread: one.  RT: safe.
class SideContact {
 public:
  /// `normal`: unit vector out of the side; zero as long as there is no contact.
  SideContact(SurfaceProbe& probe, const Vec3& normal, double friction) noexcept
      : probe_(probe), normal_(normal), friction_(friction) {}

  /// Begins a contact after a step from the proxy to `inside` that crosses an outline. Returns false, with
  /// the proxy in front of the outline, if there is no side that holds the HIP.
  bool touch(const Vec3& inside) HAPTICD_RT;

  /// Begins a contact where an outline has come over the proxy by no more than it flickers. Returns false,
  /// with the proxy in place, if there is none.
  bool comeOver() HAPTICD_RT;

  /// How a contact goes on.
  enum class Next : std::uint8_t {
    holds,
    left,   ///< the proxy is at the HIP, or nothing is between them
    front,  ///< the front is nearer to the HIP, and the proxy is on it
    gone    ///< the outline has moved past the proxy
  };
  /// Moves the proxy along the side, and with it. `is_new_frame`: the outline may have moved.
  Next follow(bool is_new_frame) HAPTICD_RT;

  const Vec3& normal() const noexcept { return normal_; }

 private:
  bool isSolid(const Vec3& place) noexcept;
  bool escape() noexcept;
  void turn() noexcept;
  void slide() noexcept;
  bool approach() noexcept;
  bool frontIsNearer() noexcept;
  Vec3 normalAt(const Vec3& inside) noexcept;
  void retreatFrom(Vec3 inside) noexcept;

  SurfaceProbe& probe_;
  Vec3 normal_;
  double friction_;
};

}  // namespace hapticd::rt
