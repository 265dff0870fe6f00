// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "drivers/camera/synthetic/scene_camera.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {

/// Cross-section of the body in front of the wall; all of them are endless along y.
enum class OccluderShape : std::uint8_t { none, box, elliptic_cylinder };

/// A body that faces the camera, and optionally one that moves in front of it. Camera at the world's origin,
/// looking along -z; metres; depths count along -z.
struct OccludedSceneParameters {
  /// x where the wall begins and ends; it is solid from its front on.
  double left_m = -std::numeric_limits<double>::infinity();
  double right_m = std::numeric_limits<double>::infinity();
  double background_m = 0;  ///< depth of a wall behind it all; 0: none
  OccluderShape occluder = OccluderShape::none;
  double width_m = 0.08;
  double thickness_m = 0.08;
  double back_m = 0.8;            ///< depth of its back
  bool projector_shadow = false;  ///< what the occluder hides from a Kinect's projector is not measured
};

/// The positions of wall and occluder in one image.
struct OccludedMoment {
  double wall_m = 1;        ///< depth of the wall's front
  double occluder_x_m = 0;  ///< of its middle
};

/// Images of such a scene by ray casting. As nothing changes along y, a column of the image has one depth.
/// Thread: one at a time.  RT: not safe.
class OccludedScene {
 public:
  /// `seed`: of the noise.
  OccludedScene(const OccludedSceneParameters& parameters, const rt::DepthModelParameters& camera,
                SceneNoise noise, std::uint32_t seed);

  /// Depth of the first surface on the rays of a column; 0 where nothing is measured: there is nothing, or
  /// the projector does not reach it. Not limited by near and far.
  double depth_m(int column, const OccludedMoment& moment) const;

  /// Renders frame `frame_number`, from 1 on, which chooses the noise.
  void render(const OccludedMoment& moment, std::uint64_t frame_number, rt::DepthFrame& frame);

  const OccludedSceneParameters& parameters() const noexcept { return parameters_; }
  const rt::DepthModelParameters& camera() const noexcept { return camera_.model(); }

 private:
  OccludedSceneParameters parameters_;
  SceneNoise noise_;
  drivers::SceneCamera camera_;
  SceneSensor sensor_;
};

/// A point of the plane y = 0: x to the right, `depth_m` along -z.
struct PlanPoint {
  double x_m;
  double depth_m;
};

/// Where the segment from `from` to `to` first meets the occluder with its middle at `occluder_x_m`, as a
/// share of the segment, 0 to 1; above 1 where it does not.
double meetsOccluder(const OccludedSceneParameters& parameters, double occluder_x_m, const PlanPoint& from,
                     const PlanPoint& to);

}  // namespace hapticd::tools
