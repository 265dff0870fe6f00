// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <variant>
#include <vector>

#include "drivers/camera/synthetic/scene_camera.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "tools/lib/truth/any_camera.h"

/// Solids whose surface is known exactly, in double precision, for scenes that rays are cast into. Metres, in
/// a frame of their own. Each knows
/// - signedDistance(p): to its surface, negative inside,
/// - rayEntry(origin, direction): the smallest s >= 0 at which origin + s * direction comes into the solid
///   from outside, infinite where it does not; the origin is outside,
/// - hold(p, before, side): where its surface holds an ideal proxy without friction that followed the HIP
///   from `before` to `p`; nothing outside. `side` is what the body remembers of the contact.
/// Thread: any.
namespace hapticd::tools {

/// `v` at length 1; `v` is not zero.
inline rt::Vec3 unitOf(const rt::Vec3& v) noexcept {
  return (1 / norm(v)) * v;
}

/// `v` turned about the direction of `rotation_rad` by its length, right-handed.
inline rt::Vec3 turned(const rt::Vec3& v, const rt::Vec3& rotation_rad) noexcept {
  const double angle = norm(rotation_rad);
  if (angle == 0) return v;
  const rt::Vec3 axis = (1 / angle) * rotation_rad;
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + (1 - std::cos(angle)) * dot(axis, v) * axis;
}

/// A frame of its own inside another one: its origin and its three axes, right-handed unit vectors, in that
/// other frame. Thread: any.
struct RigidFrame {
  rt::Vec3 origin_m{};
  rt::Vec3 x{1, 0, 0};
  rt::Vec3 y{0, 1, 0};
  rt::Vec3 z{0, 0, 1};

  rt::Vec3 directionOut(const rt::Vec3& inside) const noexcept {
    return inside.x * x + inside.y * y + inside.z * z;
  }
  rt::Vec3 positionOut(const rt::Vec3& inside_m) const noexcept { return origin_m + directionOut(inside_m); }
  rt::Vec3 directionIn(const rt::Vec3& outside) const noexcept {
    return {dot(outside, x), dot(outside, y), dot(outside, z)};
  }
  rt::Vec3 positionIn(const rt::Vec3& outside_m) const noexcept { return directionIn(outside_m - origin_m); }

  /// Turned about its own origin.
  RigidFrame spun(const rt::Vec3& rotation_rad) const noexcept {
    return {origin_m, turned(x, rotation_rad), turned(y, rotation_rad), turned(z, rotation_rad)};
  }
  /// Turned about the origin of the outer frame, then moved.
  RigidFrame moved(const rt::Vec3& rotation_rad, const rt::Vec3& shift_m) const noexcept {
    return {turned(origin_m, rotation_rad) + shift_m, turned(x, rotation_rad), turned(y, rotation_rad),
            turned(z, rotation_rad)};
  }
};

/// Where an ideal proxy is held.
struct Hold {
  rt::Vec3 proxy_m;
  rt::Vec3 outward;  ///< unit vector out of the solid
};

/// Which part of a body's surface holds the proxy, from one position of the HIP to the next.
struct HoldingSide {
  int face = -1;  ///< of a ConvexBody; -1: the HIP was outside
};

/// The half-space of all p with dot(outward, p) <= offset_m.
struct Face {
  rt::Vec3 outward;  ///< unit vector
  double offset_m = 0;

  double above_m(const rt::Vec3& p) const noexcept { return dot(outward, p) - offset_m; }
};

/// The intersection of half-spaces: a plane with solid behind it, a block, a corner of a cube. At most 8
/// faces. The proxy stays on the face that the HIP came through until it slides over an edge of it.
struct ConvexBody {
  std::vector<Face> faces;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

/// The outside of a convex hollow: inner edges and corners. Free is what lies above all faces; their
/// `outward` points into the hollow.
struct HollowBody {
  std::vector<Face> faces;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

/// A rod about the x axis, with flat ends at -half_length_m and half_length_m. Contact is with its round
/// side.
struct RodBody {
  double radius_m = 0.01;
  double half_length_m = 1;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

/// A ball around the origin.
struct BallBody {
  double radius_m = 0.05;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

using TrueBody = std::variant<ConvexBody, HollowBody, RodBody, BallBody>;

/// The point nearest to `p` of those that lie in all half-spaces, of which there are at most 8.
rt::Vec3 closestInAll(const std::vector<Face>& faces, const rt::Vec3& p);

/// A periodic motion as of an organ: a fundamental and its second and third harmonic, which begins at rest
/// at one end and first moves along `direction`.
struct Beat {
  rt::Vec3 direction{0, 0, 1};  ///< unit vector
  double hz = 1;
  std::array<double, 3> amplitudes_m{};  ///< of the fundamental and of the harmonics

  /// Displacement along `direction` after that time: the sum of (-1)^k a_k (cos(2 pi k f t) - 1).
  double displacement_m(double elapsed_s) const;
  bool rests() const { return amplitudes_m == std::array<double, 3>{}; }
};

/// The motion of the bodies of a scene in the camera's frame; a moving camera is represented by bodies that
/// move in the opposite direction. Before `start_s` they rest, and from `lasts_s` later on again.
struct BodyMotion {
  double start_s = 0;
  double lasts_s = std::numeric_limits<double>::infinity();
  rt::Vec3 velocity_m_per_s;
  rt::Vec3 turning_rad_per_s;  ///< about the camera
  rt::Vec3 spin_rad_per_s;     ///< about the origin of the bodies' frame
  rt::Vec3 sway_m;             ///< amplitudes of a sine along each axis
  rt::Vec3 sway_rad;           ///< and about each axis of the camera
  double sway_hz = 1;          ///< along x; the other axes sway a tenth faster each
  Beat beat{};

  bool rests() const;
  /// Returns the frame at `t_s` that rests at `rested`.
  RigidFrame at(const RigidFrame& rested, double t_s) const;
};

/// Bodies in front of a camera at the world's origin that looks along -z (x right, y up), all of them in one
/// frame that may move. Times in seconds.
/// Thread: one at a time (render uses a buffer of the object).  RT: not safe.
class BodyScene {
 public:
  /// `T_camera_bodies`: of the bodies' frame while they rest. `seed`: of the noise.
  BodyScene(std::vector<TrueBody> bodies, const RigidFrame& T_camera_bodies, const BodyMotion& motion,
            const rt::DepthModelParameters& depth_model, std::uint32_t seed);

  const rt::DepthModelParameters& depthModel() const noexcept { return camera_.model(); }
  const std::vector<TrueBody>& bodies() const noexcept { return bodies_; }
  bool rests() const { return motion_.rests(); }
  /// Returns T_camera_bodies at that time.
  RigidFrame frameAt(double t_s) const { return motion_.at(T_camera_bodies_, t_s); }

  /// Metres to the nearest body's surface, negative inside.
  double signedDistance(const rt::Vec3& p_m_in_world, double t_s) const;

  /// Depth Z in metres of the first surface on the ray through the point (column, row) of the image, which
  /// need not be a pixel's middle; infinite where it meets nothing.
  double trueDepth(double column, double row, double t_s) const;

  /// Renders the scene at `t_s` as frame `frame_number` (from 1 on), which chooses the noise. Nothing is
  /// measured outside the camera's near_m..far_m.
  void render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame);

 private:
  std::vector<TrueBody> bodies_;
  RigidFrame T_camera_bodies_;
  BodyMotion motion_;
  drivers::SceneCamera camera_;
  SceneSensor sensor_;
  std::optional<double> measured_at_s_;
};

/// The ideal constraint without friction: follows the HIP from tick to tick, which begins in free space, and
/// knows where the surface holds its proxy.
/// Thread: one.
class IdealConstraint {
 public:
  /// `scene` outlives the constraint.
  explicit IdealConstraint(const BodyScene& scene) : scene_(scene), sides_(scene.bodies().size()) {}

  /// Returns the hold in the world's frame; nothing while the HIP is in free space.
  std::optional<Hold> follow(const rt::Vec3& hip_m_in_world, double t_s);

 private:
  const BodyScene& scene_;
  std::vector<HoldingSide> sides_;
  std::optional<rt::Vec3> before_m_;  // in the bodies' frame
};

}  // namespace hapticd::tools
