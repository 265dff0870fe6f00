// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/deproject_kernel.h"
#include "rt/depth_frame.h"
#include "rt/depth_model.h"
#include "rt/disparity_filter.h"
#include "rt/occlusion_memory.h"
#include "rt/scene.h"
#include "rt/surface_builder.h"

namespace hapticd::rt {

/// What of a frame a force law reads, and how the frame is filtered first.
struct SceneNeeds {
  bool points = true;            ///< the points of the frame, sorted by voxel
  bool image = false;            ///< the raw values that the points come from
  bool hidden = false;           ///< also the points that something nearer hides, see OcclusionMemory
  bool visible_surface = false;  ///< the visible surface
  double radius_m = 0.04;        ///< around the focus (ForceLaws::focus_m_in_world), for one evaluation
  SurfaceParameters surface;
  FilterParameters filter;

  static SceneNeeds of(const LiveParameters& parameters) noexcept;
  /// True if `scene` holds all that is needed for a focus within `margin_m` of `focus_m_in_world`.
  bool metBy(const Scene& scene, const Vec3& focus_m_in_world, double margin_m) const noexcept;
};

/// How far around its focus a model must reach, metres: what one evaluation reads, and what the focus covers
/// until the next frame is modelled.  RT: safe.
constexpr double reachOfModel_m(const SceneNeeds& needs, const GridParameters& grid) noexcept {
  return needs.radius_m + grid.max_hip_speed_m_per_s * (grid.frame_period_s + grid.frame_margin_s);
}

/// Turns a raw depth frame into a Scene in a fixed amount of memory: the points by a counting sort over
/// voxels, the surface by a SurfaceBuilder.
///
/// Thread: one (the scene thread).  RT: build() allocates nothing, its cost is bounded by the frame's pixels.
class SceneBuilder {
 public:
  /// `model` outlives the builder and every scene that it built.
  SceneBuilder(const DepthModel& model, const GridParameters& parameters);

  const GridShape& shape() const noexcept { return shape_; }
  /// Points that a scene of this builder can hold.
  std::size_t pointCapacity() const noexcept { return point_capacity_; }
  /// Largest radius whose ball fits into the window wherever its centre lies between voxel corners; infinite
  /// when the whole frame is modelled.
  double largestBall_m() const noexcept;

  /// Models what `needs` asks for within `radius_m` of `centre_m_in_world`; cut to largestBall_m() for the
  /// points. All points of the frame are modelled
  /// when that is the configured extent. `scene` is attached to memory of this shape and capacity, and gets
  /// the next number. Points over capacity are left out, last rows of the image first, and counted in the
  /// scene.
  void build(const DepthFrame& frame, const Vec3& centre_m_in_world, double radius_m, Scene& scene,
             const SceneNeeds& needs = {}) noexcept;

  /// The next scene depends on its own frame only, not on those before: filter, fusion and the memory of
  /// what is hidden start anew.
  void forget() noexcept {
    occlusions_.forget();
    filter_.forget();
    surface_builder_.forget();
  }

 private:
  void buildPoints(const DepthFrame& frame, const SceneNeeds& needs, Scene& scene) noexcept;
  static void keepImage(const std::uint16_t* raw, const PixelWindow& window, Scene& scene) noexcept;
  DeprojectJob jobOf(const Scene& scene, const PixelWindow& window) const noexcept;
  void place(const Vec3& centre_m_in_world, double radius_m, Scene& scene) const noexcept;
  PixelWindow windowOf(const Scene& scene) const noexcept;

  const DepthModel& model_;
  ModelExtent extent_;
  GridShape shape_;
  std::size_t point_capacity_;
  std::unique_ptr<GridPoint[]> in_image_order_;
  std::unique_ptr<std::uint32_t[]> voxel_of_row_;
  std::unique_ptr<std::uint32_t[]> pixel_of_row_;
  std::unique_ptr<std::uint32_t[]> run_voxel_;
  std::unique_ptr<std::uint32_t[]> run_begin_;
  DisparityFilter filter_;
  OcclusionMemory occlusions_;
  SurfaceBuilder surface_builder_;
};

}  // namespace hapticd::rt
