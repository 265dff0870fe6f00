// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "rt/realtime_safe.h"
#include "rt/scene.h"
#include "rt/shape.h"
#include "rt/visible_surface.h"

namespace hapticd::rt {

/// Signed distance of places from the visible surface of a scene, as the law `surface` sees it: positive in
/// front, negative inside the solid. The surface is the union of the facets' patches, each as large as its
/// block in the image, so the distance is continuous, also beside the outline of a body. Where patches join
/// smoothly, their interpolation counts.
/// Thread: any.  RT: safe.
class SurfaceDistance {
 public:
  /// `scene.has_surface` must be true. `age_s`: see LawInput::frame_age_s.
  SurfaceDistance(const Scene& scene, double shell_m, double age_s) noexcept
      : surface_(scene.surface),
        model_(*scene.depth_model),
        view_(scene.surface, *scene.depth_model, shell_m, age_s),
        age_s_(age_s) {}

  /// Distance and its gradient; infinite if no surface is within the range of the search.
  struct Result {
    SignedDistance signed_distance{std::numeric_limits<double>::infinity(), {}};
    double speed_m_per_s = 0;  ///< of the surface along the normal
    bool modelled = false;     ///< the scene covers the place

    bool found() const noexcept {
      return signed_distance.distance_m < std::numeric_limits<double>::infinity();
    }
  };
  /// Looks for the surface within `most_m` of a place.
  Result at(const Vec3& p_m_in_world, double most_m) const HAPTICD_RT;

  /// Returns the width of a pixel at the depth of a place, in metres.
  double pitch_m(const Vec3& p_m_in_world) const noexcept {
    return view_.pitch_m(SurfaceView::depthOf(model_.positionInCamera(p_m_in_world)));
  }

 private:
  struct Nearest;
  void searchLayer(const SurfaceLayer& layer, const Vec3& p, const BlockWindow& window,
                   Nearest& nearest) const HAPTICD_RT;
  void refine(const Vec3& p, Nearest& nearest) const HAPTICD_RT;

  const VisibleSurface& surface_;
  const DepthModel& model_;
  SurfaceView view_;
  double age_s_;
};

}  // namespace hapticd::rt
