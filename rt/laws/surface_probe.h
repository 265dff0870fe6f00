// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/laws/force_law.h"
#include "rt/laws/surface.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// The proxy of the law `surface` during one tick, and the surface where it is. Positions are in metres in
/// the camera's frame.
/// Thread: one.  RT: safe.
class SurfaceProbe {
 public:
  using Where = SurfaceView::Where;
  using Place = SurfaceView::Place;

  /// Shorter displacements count as zero.
  static constexpr double kNone_m = 1e-7;
  /// Longest step between two samples of the surface, in pixel pitches: no body visible in the image is
  /// thinner.
  static constexpr double kStride_px = 2;
  /// Distance, in pixel pitches, within which an outline is looked for: it flickers by that much from frame
  /// to frame.
  static constexpr double kOutline_px = 2;
  /// Unit vectors across the optical axis.
  static constexpr double kDiagonal = 0.70710678118654752;
  static constexpr Vec3 kAround[8] = {
      {1, 0, 0},  {kDiagonal, kDiagonal, 0},   {0, 1, 0},  {-kDiagonal, kDiagonal, 0},
      {-1, 0, 0}, {-kDiagonal, -kDiagonal, 0}, {0, -1, 0}, {kDiagonal, -kDiagonal, 0}};
  /// Returns whether two normals differ by more than those of one smooth surface nearby.
  static bool isSharpTurn(const Vec3& normal, const Vec3& other) noexcept {
    constexpr double kTurn_cos = 0.82;  // 35 degrees
    return dot(normal, other) < kTurn_cos;
  }
  /// A tolerance that accepts every place.
  static constexpr double kAnyDistance_m = 10;

  /// The proxy is at `start_m`; nothing is looked up.
  SurfaceProbe(const LawInput& input, const Vec3& start_m) noexcept
      : p(start_m),
        hip(input.scene.depth_model->positionInCamera(input.hip_m_in_world)),
        view(input.scene.surface, *input.scene.depth_model, input.parameters.surface.shell_m,
             input.frame_age_s),
        surface_(input.scene.surface),
        model_(*input.scene.depth_model) {}

  /// Returns whether a look-up is left, and `reserve` more.
  bool maySample(int reserve = 0) const noexcept { return samples_ + reserve < kMaxSurfaceSamples; }
  Place placeOf(const Vec3& place) noexcept {
    ++samples_;
    return view.sample(place);
  }
  Sheet sheetNear(const ImagePosition& image, double depth_m) noexcept {
    ++samples_;
    return view.sheetNear(image, depth_m);
  }
  void look() noexcept { at = placeOf(p); }

  Vec3 toHip() const noexcept { return hip - p; }
  double pitch_m() const noexcept { return view.pitch_m(SurfaceView::depthOf(p)); }
  double stride_m() const noexcept { return kStride_px * pitch_m(); }
  /// Returns by how much facets of the same surface may disagree.
  double noise_m() const noexcept {
    constexpr double kNoiseUnits = 1.5;
    return kNoiseUnits * view.noiseUnit_m(SurfaceView::depthOf(p));
  }
  /// Returns how far a continuous surface may be off the place after a step of this length: its distance
  /// changes by no more than the step. The factor leaves room for facets that do not quite agree.
  double tolerance_m(double step_m) const noexcept {
    constexpr double kContinuity = 2.5;
    return kContinuity * step_m + noise_m();
  }
  bool covers(const Vec3& place) const noexcept { return surface_.covers(model_.positionInWorld(place), 0); }

  /// Moves the proxy onto the nearest plane with about that normal of a surface that begins next to it,
  /// within kOutline_px, no farther than `room_m` from the proxy. Returns false if there is none.
  bool settleBeside(const Vec3& normal, double room_m) noexcept {
    const double radius = kOutline_px * pitch_m();
    const double depth_m = SurfaceView::depthOf(p);
    Sheet nearest;
    double nearest_m = room_m;
    for (const Vec3& direction : kAround) {
      const ImagePosition image = view.project(p + radius * direction);
      if (!view.isInImage(image)) continue;
      const Sheet sheet = sheetNear(image, depth_m);
      if (!sheet.exists || isSharpTurn(sheet.normal_in_camera, normal)) continue;
      const double off_m = std::abs(SurfaceView::distanceFrom(sheet, p));
      if (off_m >= nearest_m) continue;
      nearest = sheet;
      nearest_m = off_m;
    }
    if (!nearest.exists) return false;
    p = p - SurfaceView::distanceFrom(nearest, p) * nearest.normal_in_camera;
    at = {.where = Where::free, .sheet = nearest, .distance_m = 0};
    return true;
  }

  /// Moves the proxy to the point of the surface at the image position of `place`, near the depth `depth_m`.
  /// Returns false if there is none within `room_m` of `place`.
  bool settleOn(const Vec3& place, double depth_m, double room_m) noexcept {
    if (!(SurfaceView::depthOf(place) > SurfaceView::kNearest_m)) return false;
    const ImagePosition image = view.project(place);
    if (!view.isInImage(image)) return false;
    const Sheet sheet = sheetNear(image, depth_m);
    if (!sheet.exists || std::abs(SurfaceView::distanceFrom(sheet, place)) > room_m) return false;
    const Vec3 on_surface = view.placeAt(image, sheet.depth_m());
    if (!covers(on_surface)) {
      cut_off = true;
      return false;
    }
    p = on_surface;
    at = {.where = Where::free, .sheet = sheet, .distance_m = 0};
    return true;
  }

  /// Returns whether the surface turns away from `normal` and is nearly parallel to the ray: it goes around
  /// the edge of a body.
  bool turnsAwayFrom(const Vec3& normal) const noexcept {
    constexpr double kSteep_cos = 0.26;  // 75 degrees
    const Vec3& here = at.sheet.normal_in_camera;
    return isSharpTurn(here, normal) && -dot(here, p) < kSteep_cos * norm(p);
  }

  /// Compensates for the outline of a body that flickers from frame to frame: moves the proxy to the nearest
  /// point of the surface between `from`, at the outline, and the point in front of the HIP at which the
  /// surface does not turn away from `normal`. Returns false, leaving the proxy in place, if there is none.
  bool settleTowards(const Vec3& from, const Vec3& over_hip, const Vec3& normal) noexcept {
    const Vec3 start = p;
    const Place at_start = at;
    const double depth_m = SurfaceView::depthOf(from);
    const Vec3 displacement = over_hip - from;
    constexpr int kSteps = 6;
    for (int i = 1; i <= kSteps; ++i) {
      const double share = static_cast<double>(i) / kSteps;
      const Vec3 step = share * displacement;
      if (settleOn(from + step, depth_m, tolerance_m(norm(step))) && !turnsAwayFrom(normal)) return true;
    }
    p = start;
    at = at_start;
    return false;
  }

  Vec3 p;    ///< the proxy
  Place at;  ///< the surface where it is
  const Vec3 hip;
  bool cut_off = false;  ///< a step reached the end of the model
  SurfaceView view;

 private:
  const VisibleSurface& surface_;
  const DepthModel& model_;
  int samples_ = 0;
};

}  // namespace hapticd::rt
