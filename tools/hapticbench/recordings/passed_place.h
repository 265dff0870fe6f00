// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "rt/depth_frame.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/recordings/disparity_fit.h"
#include "tools/hapticbench/recordings/pixel_statistics.h"

namespace hapticd::tools {

/// The background at rest, pixel by pixel in the order of a frame's image: the mean of the measurements that
/// are about the farthest, raw disparities; NaN where fewer than three tenths of the frames show it.
std::vector<float> restingBackground(const BenchSequence& session, std::span<const PixelStatistics> pixels,
                                     const CameraDisparity& camera);

/// A position on a resting surface in front of which something passes.
struct PassedPlace {
  DisparityQuadratic surface;  ///< of the background around it
  double column = 0;
  double row = 0;
  int half_px = 0;  ///< the square that a patch of 40 mm around it covers
  double distance_m = 0;
  SurfacePoint point;
  std::vector<bool> covered;  ///< frame by frame: something nearer covers a part of the square, or nothing is
                              ///< measured in most of it
};

/// Up to `most` positions, spread over the image, that something passes in two frames or more and that are in
/// sight for half a second.
std::vector<PassedPlace> passedPlaces(const BenchSequence& session, std::span<const float> background,
                                      const CameraDisparity& camera, int most);

/// The longest run of frames in which a position is not covered, the first of equal ones.
struct InSight {
  int first = 0;
  int frames = 0;
};
InSight longestInSight(const std::vector<bool>& covered);

/// True if a measured point of the frame is within `radius_m` of `centre_m` and more than `before_m` before
/// the surface there.
bool measuresNear(const rt::DepthFrame& frame, const CameraDisparity& camera, const PassedPlace& place,
                  const rt::Vec3& centre_m, double radius_m, double before_m);

}  // namespace hapticd::tools
