// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/law_truth.h"

#include <algorithm>
#include <optional>

#include "rt/depth_model.h"
#include "rt/disparity_filter.h"
#include "tools/hapticbench/accuracy/frame_surface.h"
#include "tools/hapticbench/accuracy/spring_truth.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// The disparities that a constraint law is built from, around one place.
class FilteredImage {
 public:
  FilteredImage(const rt::DepthModelParameters& camera, const Vec3& centre_m, double radius_m,
                const rt::FilterParameters& filter)
      : model_(camera, {}),
        filter_(model_),
        parameters_(filter),
        window_(model_.windowOfBall(centre_m, radius_m)),
        disparity_(rt::kFramePixels, -1.0F) {
    window_.raw_first = model_.wholeFrame().raw_first;  // as wide in depth as the camera
    window_.raw_last = model_.wholeFrame().raw_last;
  }

  void show(const rt::DepthFrame& frame) {
    const float* filtered = filter_.apply(frame, window_, parameters_);
    for (int row = window_.row_first; row <= window_.row_last; ++row) {
      const int begin = row * rt::kFrameWidth;
      std::copy(filtered + begin + window_.column_first, filtered + begin + window_.column_last + 1,
                disparity_.begin() + begin + window_.column_first);
    }
  }
  const float* disparity() const { return disparity_.data(); }

 private:
  rt::DepthModel model_;
  rt::DisparityFilter filter_;
  rt::FilterParameters parameters_;
  rt::PixelWindow window_;
  std::vector<float> disparity_;
};

double planeForce_n(const TrueScene& scene, const CourseTick& tick, double depth_m,
                    const rt::LiveParameters& parameters) {
  const rt::SpringParameters& springs = parameters.springs;
  if (parameters.law == rt::ForceLaw::smooth_springs)
    return smoothSpringsAbovePlane_n(springs, -tick.depth_m);
  const double disc_m = nearestDiscRadius_m(scene.depthModel(), depth_m, springs.max_points);
  return nearestSpringsAbovePlane_n(springs, disc_m, -tick.depth_m);
}

}  // namespace

std::vector<Vec3> springTruth_n(const TrueScene& scene, const Course& course,
                                const rt::LiveParameters& parameters) {
  constexpr double kFarthest_m =
      0.1;  // of a point that the HIP feels from the approach: D, the way in and aside
  const TrueSceneParameters& shape = scene.parameters();
  const bool faces_camera = shape.kind == SceneKind::plane && shape.tilt_rad == 0;
  std::vector<Vec3> points;
  if (!faces_camera) points = exactPoints_m(scene, scene.approach(0).surface_m_in_world, kFarthest_m, 0);
  std::vector<Vec3> truth;
  for (const CourseTick& tick : course.ticks) {
    if (tick.sample == SamplePlace::none) continue;
    if (faces_camera) {
      const double depth_m = -tick.hip_m.z - tick.depth_m;
      truth.push_back(planeForce_n(scene, tick, depth_m, parameters) * course.outward);
    } else if (parameters.law == rt::ForceLaw::smooth_springs) {
      truth.push_back(smoothSpringsOver_n(points, tick.hip_m, parameters.springs));
    } else {
      truth.push_back(nearestSpringsOver_n(points, tick.hip_m, parameters.springs));
    }
  }
  return truth;
}

std::vector<Vec3> constraintTruth_n(const TrueScene& scene, const Course& course, FrameReel& reel,
                                    int first_frame, const rt::LiveParameters& parameters) {
  constexpr double kAround_m = 0.1;    // all that is searched lies that near to the approach
  constexpr double kBeyond_m = 0.005;  // the noisy surface may be that much farther than the true one
  const bool moves = scene.parameters().speed_m_per_s > 0;
  const Vec3 middle = scene.approach(0).surface_m_in_world + (moves ? kAdvance_m / 2 : 0) * Vec3{0, 0, 1};
  FilteredImage image(scene.depthModel(), middle, kAround_m, parameters.filter);
  FrameSurface surface(image.disparity(), scene.depthModel());
  std::vector<Vec3> truth;
  int shown = first_frame - 1;
  for (const CourseTick& tick : course.ticks) {
    while (shown < tick.frame) image.show(reel.frame(++shown));
    if (tick.sample == SamplePlace::none) continue;
    const double radius_m = 1.5 * std::abs(tick.depth_m) + kBeyond_m;
    const std::optional<Vec3> closest = surface.closestBehind(tick.hip_m, radius_m);
    truth.push_back(closest ? parameters.springs.stiffness_n_per_m * (*closest - tick.hip_m) : Vec3{});
  }
  return truth;
}

}  // namespace hapticd::tools
