// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/laws/force_law.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// The signed distance of the visible scene at a place, and what it is the distance of. Metres, camera frame.
struct SurfaceLook {
  Vec3 place_m;
  double room_m = 1;         ///< to the boundary of the solid, negative inside; 1 where nothing is known
  Vec3 normal;               ///< gradient of the distance, a unit vector; zero where nothing is known
  Sheet sheet;               ///< the front of the body that the distance is of; may not exist
  bool at_side = false;      ///< the side of that body is nearer than its front
  bool bridged = false;      ///< it is not measured there, but assumed to go on
  SurfaceView::Place own{};  ///< what the place's own ray shows

  bool isIn(SurfaceView::Where where) const noexcept { return own.where == where; }
};

/// The visible scene as one signed distance. A body is what its front shows, and extends straight back from
/// its outline in the image, as deep as the shell. So the distance is that of the front's tangent plane, that
/// of the outline, or, in front of the one and beside the other, that of the edge between them: sides, edges
/// and fronts are places of one function.
///
/// An outline is where the share of the pixels around an image position that show the body, weighted with a
/// kernel of kRadius_px, is one half. The distance from it follows from the share, as if the outline were
/// straight; the direction is the share's gradient.
/// Thread: one.  RT: safe.
class SurfaceField {
 public:
  explicit SurfaceField(const LawInput& input) noexcept
      : view_(input.scene.surface, *input.scene.depth_model, input.parameters.surface.shell_m,
              input.frame_age_s),
        surface_(input.scene.surface),
        model_(*input.scene.depth_model),
        shell_m_(input.parameters.surface.shell_m) {}

  SurfaceLook look(const Vec3& p) const HAPTICD_RT;

  const SurfaceView& view() const noexcept { return view_; }
  /// From now on, a surface more than a shell behind what hides it is looked up in its place.
  void lookPast() noexcept { view_.lookPast(); }
  /// From now on, the surface that holds a proxy goes on over a gap in the measurements around the HIP, as
  /// the plane between where it was last seen, with that `normal`, and where it is seen again behind the gap,
  /// within `reach_m`; if that is not modelled, as the plane that it was. What is seen there must fit.
  void bridge(const Vec3& proxy_m, const Vec3& hip_m, const Vec3& seen_m, const Vec3& normal,
              double reach_m) noexcept;

  /// Returns whether surfaces of different bodies, or the end of one, are seen within the kernel's reach.
  bool isNearOutline(const Vec3& p) const noexcept { return hasOutline(view_.project(p), false); }

  double pitch_m(const Vec3& p) const noexcept { return view_.pitch_m(SurfaceView::depthOf(p)); }
  /// Returns by how much facets of the same surface may disagree.
  double noise_m(const Vec3& p) const noexcept {
    constexpr double kNoiseUnits = 1.5;
    return kNoiseUnits * view_.noiseUnit_m(SurfaceView::depthOf(p));
  }

 private:
  /// Of the pixels around an image position, those that show a body.
  struct Share {
    double value = 0;       ///< 0..1
    double per_column = 0;  ///< its gradient
    double per_row = 0;
    double raw = 0;  ///< mean of their disparities
  };
  /// Which pixels show it: those with a raw disparity from `first` to `last`, or to that of a plane.
  struct Limit {
    double first;
    double last;
    double of_plane;  ///< at the image position
    double per_column;
    double per_row;
    bool or_hidden;  ///< the hidden layer may show it as well
  };
  bool hasOutline(const ImagePosition& image, bool or_hidden) const noexcept;
  bool isModelled(const ImagePosition& image) const noexcept;
  bool isUnmeasured(const ImagePosition& image) const noexcept;
  /// What is behind a gap in the measurements.
  enum class GapEnd : std::uint8_t {
    none,     ///< there is no gap, or it is too long
    unknown,  ///< it goes on beyond what is modelled
    seen,
  };
  GapEnd crossGap(ImagePosition& image, const ImagePosition& step, double most_px,
                  bool in_gap) const noexcept;
  Sheet bridgeAt(const ImagePosition& image) const noexcept;
  Share shareOf(const ImagePosition& image, const Limit& limit) const noexcept;
  Limit limitOf(const Sheet& front, double depth_m, double allowance_m) const noexcept;
  Limit limitAt(double depth_m, double allowance_m) const noexcept;
  Sheet frontBeside(const Vec3& inside, double depth_m, double allowance_m, double raw) const noexcept;

  SurfaceView view_;
  const VisibleSurface& surface_;
  const DepthModel& model_;
  double shell_m_;
  bool bridges_ = false;
  double bridge_distance_m_ = 0;  ///< of the surface over the gap, from the camera
  Vec3 bridge_normal_;
};

}  // namespace hapticd::rt
