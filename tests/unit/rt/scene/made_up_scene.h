// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/modelling/scene_builder.h"
#include "rt/scene/scene.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"

/// Frames of a camera, the scenes that are built of them, and what forces on these may differ by.
namespace hapticd::test {

using FramePointer = std::unique_ptr<rt::DepthFrame>;

/// Returns a frame in which every pixel has this raw value. All frames made here have sequence number 1.
FramePointer frameOf(std::uint16_t raw);
/// Returns a frame with raw(u, v) at each pixel.
FramePointer frameOf(const std::function<std::uint16_t(int u, int v)>& raw);
/// Returns a frame with the raw values whose depths are nearest to depth_m(u, v); 2047 where that is not
/// positive or not finite.
FramePointer frameOfDepth(const rt::DepthModelParameters& model,
                          const std::function<double(int u, int v)>& depth_m);

/// Returns random 16-bit words, most of which are invalid raw values.
FramePointer damagedFrame(std::uint32_t seed);
/// Returns random raw values first..last.
FramePointer randomFrame(std::uint32_t seed, std::uint16_t first, std::uint16_t last);
/// Returns a slanted plane with a sphere in front of it and 0.1 raw units of Gaussian noise.
FramePointer planeAndSphereFrame(std::uint32_t seed, const rt::DepthModelParameters& model);
/// Returns the two values alternating like a chess board.
FramePointer checkerboardFrame(std::uint16_t even, std::uint16_t odd);

/// Sets the coefficients a and b such that raw 0 is at `nearest_m` and raw 2046 at `farthest_m`, with limits
/// just outside.
void spreadRawValuesOver(double nearest_m, double farthest_m, rt::DepthModelParameters& model);

/// A builder with the memory of one scene, and the scene built last.
class BuiltScene {
 public:
  BuiltScene(const rt::DepthModel& model, const rt::GridParameters& parameters)
      : builder(model, parameters), storage_(builder.shape(), builder.pointCapacity(), builder.model()) {
    storage_.attachTo(scene);
  }

  /// Builds the largest possible ball unless a radius is given. Returns the scene.
  const rt::Scene& build(const rt::DepthFrame& frame, const rt::Vec3& centre_m_in_world = {},
                         double radius_m = std::numeric_limits<double>::infinity()) {
    builder.build(frame, centre_m_in_world, radius_m, scene);
    return scene;
  }

  rt::SceneBuilder builder;
  rt::Scene scene;

 private:
  rt::SceneStorage storage_;
};

inline rt::GridParameters wholeFrameGrid() {
  rt::GridParameters parameters;
  parameters.extent = rt::ModelExtent::frame;
  return parameters;
}

/// Expects that the scene's voxels, ranks and ranges are consistent, and that each voxel's range holds the
/// points whose position is in that voxel (points near its border within the accuracy of the positions).
void expectVoxelsToHoldTheirPoints(const rt::Scene& scene);

/// Expects that the scene contains each point of the frame within its ball exactly once, at the right
/// position, and none that is farther away than the ball's radius plus twice the accuracy of positions.
/// `cloud`: all points of the frame.
void expectAllPointsOfTheBall(const rt::Scene& scene, const tools::PointCloud& cloud);

/// Expects that two scenes are bitwise equal.
void expectTheSameScene(const rt::Scene& actual, const rt::Scene& expected);

/// Returns how far the law's force may deviate from an exact evaluation by rounding alone, in newtons.
/// Positions of a few metres are rounded to about 1e-15 m, which changes the direction of a spring of length
/// s by 1e-15 / s; s is at least 1e-6 m here (1e-8 N for k D = 20 N; all other rounding is much smaller).
inline double roundingTolerance_n(const rt::SpringParameters& parameters) {
  return 1e-9 * parameters.stiffness_n_per_m * parameters.radius_m;
}

/// Returns whether the choice of points depends on distances that differ by less than rounding (1e-12 m):
/// another choice is equally correct.
inline bool isUndecided(const tools::SpringOracle& oracle) {
  constexpr double kIndistinguishable_m = 1e-12;
  return oracle.radiusMargin_m() < kIndistinguishable_m || oracle.rankMargin_m() < kIndistinguishable_m;
}

}  // namespace hapticd::test
