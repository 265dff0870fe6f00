// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/requirement.h"

namespace hapticd::tools {

/// Times of modelling one frame of a camera, medians in nanoseconds.
struct CameraCost {
  std::string camera;
  double distance_m = 0;
  int pixels_in_reach = 0;       ///< pixels whose rays meet the ball that the HIP can reach
  double reach_ns = 0;           ///< the points in reach, for the paper's law
  double surface_ns = 0;         ///< the visible surface in reach, for the law `surface`
  double frame_ns = 0;           ///< all points; 0 where their raw values cover too wide a range
  double tree_ns = 0;            ///< nanoflann's tree of all points
  double kinect_distance_m = 0;  ///< of the Kinect that it is compared with
  int kinect_pixels_in_reach = 0;
  double kinect_reach_ns = 0;
  double kinect_surface_ns = 0;

  double timesCheaperThanTree() const { return tree_ns / reach_ns; }
  /// Cost per pixel in reach relative to the Kinect's.
  double reachPerPixel() const { return perPixel(reach_ns, kinect_reach_ns); }
  double surfacePerPixel() const { return perPixel(surface_ns, kinect_surface_ns); }

 private:
  double perPixel(double ns, double kinect_ns) const {
    return ns / pixels_in_reach / (kinect_ns / kinect_pixels_in_reach);
  }
};

/// Measures all cameras at the distances that lie in their range. `repetitions`: of each timed model.
std::vector<CameraCost> measureCameraCosts(int repetitions, const std::vector<double>& distances_m);

/// The requirements on the cost of the reach, and of the law `surface`.
std::vector<Requirement> requirementsOf(const std::vector<CameraCost>& costs);

}  // namespace hapticd::tools
