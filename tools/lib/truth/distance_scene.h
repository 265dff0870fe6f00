// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "drivers/camera/synthetic/scene_camera.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/body_scene.h"

/// Scenes whose truth is their signed distance: solids of closed form, what a camera sees of them by sphere
/// tracing, and the god-object that their surface holds.
namespace hapticd::tools {

/// The surface nearest to a place.
struct NearestSurface {
  double distance_m = 0;  ///< exact outside, negative inside
  rt::Vec3 outward;       ///< the gradient of the distance, a unit vector
};

/// Solids in frames of their own, metres. A hollow, the outside of a wedge or corner, is a union of planes.
struct PlaneShape {};  ///< z <= 0
struct BallShape {
  double radius_m;
};
/// About the x axis, with round ends beyond the half length.
struct CapsuleShape {
  double radius_m;
  double half_length_m;
};
struct BoxShape {
  rt::Vec3 half_m;
};
/// A plate with a hole, about the z axis.
struct RingShape {
  double inner_m;
  double outer_m;
  double half_thickness_m;
};
/// z <= 0 but for a half ball around the origin.
struct BowlShape {
  double radius_m;
};
using DistanceShape = std::variant<PlaneShape, BallShape, CapsuleShape, BoxShape, RingShape, BowlShape>;

struct DistanceBody {
  DistanceShape shape;
  RigidFrame frame;  ///< T_world_shape at t_s = 0
  rt::Vec3 velocity_m_per_s{};

  NearestSurface nearest(const rt::Vec3& p_m_in_world, double t_s) const;
};

/// Pixels without measurement.
struct ImageGap {
  double first_column, last_column;
  double first_row, last_row;
};

/// The union of bodies in front of a camera at the world's origin that looks along -z (x right, y up).
/// Thread: one at a time (render uses a buffer of the object).  RT: not safe.
class DistanceScene {
 public:
  /// `seed`: of the noise.
  DistanceScene(std::vector<DistanceBody> bodies, std::vector<ImageGap> gaps,
                const rt::DepthModelParameters& depth_model, std::uint32_t seed);

  const std::vector<DistanceBody>& bodies() const noexcept { return bodies_; }
  const rt::DepthModelParameters& depthModel() const noexcept { return camera_.model(); }
  bool rests() const noexcept { return rests_; }

  NearestSurface nearest(const rt::Vec3& p_m_in_world, double t_s) const;
  double signedDistance(const rt::Vec3& p_m_in_world, double t_s) const {
    return nearest(p_m_in_world, t_s).distance_m;
  }

  /// Depth Z in metres of the first surface on the ray of that direction, of which z is -1, from the camera;
  /// infinite where it meets nothing.
  double trueDepth(const rt::Vec3& ray, double t_s) const;
  /// How far a place is behind what the camera sees on its ray, along the optical axis; negative in front.
  double behindSight_m(const rt::Vec3& p_m_in_world, double t_s) const;

  /// Renders the scene at `t_s` as frame `frame_number` (from 1 on), which chooses the noise. Nothing is
  /// measured outside the camera's near_m..far_m.
  void render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame);

 private:
  std::vector<DistanceBody> bodies_;
  std::vector<ImageGap> gaps_;
  bool rests_;
  drivers::SceneCamera camera_;
  SceneSensor sensor_;
  std::optional<double> measured_at_s_;
};

/// The god-object of Zilles and Salisbury 1995 on a signed distance, without friction: a proxy that starts
/// with the HIP in free space and then always moves nearer to it, in steps of at most 0.2 mm that leave no
/// body's tangent plane. It stops where up to three of these hold it, however near a way out may be
/// elsewhere. Thread: one.
class GodObject {
 public:
  /// `scene` outlives the object.
  explicit GodObject(const DistanceScene& scene) : scene_(scene) {}

  /// Returns the proxy in the world's frame. Where a body moves over it, it moves out of the body.
  rt::Vec3 follow(const rt::Vec3& hip_m_in_world, double t_s);

 private:
  rt::Vec3 movedOut(rt::Vec3 place_m, double t_s) const;
  /// The nearest place to the HIP that the tangent planes of the bodies near the proxy allow.
  rt::Vec3 target(const rt::Vec3& hip_m, double t_s) const;

  const DistanceScene& scene_;
  std::optional<rt::Vec3> proxy_m_;
};

}  // namespace hapticd::tools
