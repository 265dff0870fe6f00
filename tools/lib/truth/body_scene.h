// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/camera/synthetic/scene_camera.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"
#include "tools/lib/truth/rigid_frame.h"
#include "tools/lib/truth/scene_noise.h"
#include "tools/lib/truth/true_body.h"

namespace hapticd::tools {

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
/// move in the opposite direction. Before `start_s` they rest.
struct BodyMotion {
  double start_s = 0;
  rt::Vec3 velocity_m_per_s;
  rt::Vec3 turning_rad_per_s;  ///< about the camera
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
