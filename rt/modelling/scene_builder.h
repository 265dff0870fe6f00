// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_filter.h"
#include "rt/depth/disparity_image.h"
#include "rt/modelling/deproject_kernel.h"
#include "rt/modelling/occlusion_memory.h"
#include "rt/modelling/surface/surface_builder.h"
#include "rt/scene/scene.h"
#include "rt/scene/surface_noise.h"

namespace hapticd::rt {

/// The data that a force law reads from a frame, and the filtering that precedes it.
struct SceneNeeds {
  bool points = true;            ///< the points of the frame, sorted by voxel
  bool image = false;            ///< the raw values that the points come from
  bool hidden = false;           ///< also the points hidden behind something nearer, see OcclusionMemory
  bool visible_surface = false;  ///< the visible surface
  double radius_m = 0.04;        ///< around the focus (ForceLaws::focus_m_in_world), for one evaluation
  SurfaceParameters surface;
  FilterParameters filter;

  /// Returns the needs of the law selected by `parameters`.
  static SceneNeeds of(const LiveParameters& parameters) noexcept;
  /// Returns true if `scene` holds everything needed for a focus within `margin_m` of `focus_m_in_world`.
  bool metBy(const Scene& scene, const Vec3& focus_m_in_world, double margin_m) const noexcept;
};

/// Returns the radius in metres around its focus that a model must cover: what one evaluation reads plus the
/// displacement of the focus until the next frame is modelled.  RT: safe.
constexpr double reachOfModel_m(const SceneNeeds& needs, const GridParameters& grid) noexcept {
  return needs.radius_m + grid.max_hip_speed_m_per_s * (grid.frame_period_s + grid.frame_margin_s);
}

/// Returns the largest radius around the focus whose raw values fit into PackedPixel, with a linear depth law
/// of this unit.  RT: safe.
constexpr double largestReachOfUnit_m(double unit_m) noexcept {
  constexpr double kRounding_raw = 4;  // at both ends
  return 0.5 * (PackedPixel::kRawRange - kRounding_raw) * unit_m;
}

/// Builds a Scene from a raw depth frame in a fixed amount of memory: the points by a counting sort over
/// voxels, the surface by a SurfaceBuilder.
///
/// Thread: one (the scene thread).  RT: build() allocates nothing; its cost is bounded by the pixels of the
/// frame.
class SceneBuilder {
 public:
  /// `model` outlives the builder and every scene built by it.
  SceneBuilder(const DepthModel& model, const GridParameters& parameters);

  const DepthModel& model() const noexcept { return model_; }
  const GridShape& shape() const noexcept { return shape_; }
  /// Returns the number of points that a scene of this builder can hold.
  std::size_t pointCapacity() const noexcept { return point_capacity_; }
  /// Returns the largest radius of a ball that fits into the window for any position of its centre between
  /// voxel corners, and whose raw values fit into PackedPixel; infinite when the whole frame is modelled.
  double largestBall_m() const noexcept;

  /// Builds the data listed in `needs` within `radius_m` of `centre_m_in_world`; for the points the radius is
  /// limited to largestBall_m(). All points of the frame are included if the configured extent is the frame.
  /// `scene` must be attached to memory of this shape and capacity; it gets the next number. Points over
  /// capacity are dropped, from the last rows of the image first, and counted in the scene.
  void build(const DepthFrame& frame, const Vec3& centre_m_in_world, double radius_m, Scene& scene,
             const SceneNeeds& needs = {}) noexcept;

  /// Returns working memory, which no other thread reads, to the system until it is used, see
  /// rt::returnPages(): a law needs only part of it, and the ball a part of that. Before the first frame. RT:
  /// not safe.
  void returnUnusedMemory() noexcept;

  /// Makes the next scene depend on its own frame only: restarts the filter, the fusion of frames and the
  /// memory of hidden surfaces.
  void forget() noexcept {
    occlusions_.forget();
    filter_.forget();
    surface_builder_.forget();
    noise_meter_.forget();
  }

 private:
  void updateOcclusions(const DepthFrame& frame, const PixelWindow& window) noexcept;
  const std::uint16_t* hiddenAsRaw(const PixelWindow& window) noexcept;
  void buildPoints(const DepthFrame& frame, const Vec3& focus_m_in_world, const SceneNeeds& needs,
                   Scene& scene) noexcept;
  void keepImage(const std::uint16_t* raw, const PixelWindow& window, Scene& scene) const noexcept;
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
  DisparityImage disparity_;
  std::unique_ptr<std::uint16_t[]> hidden_raw_;  // empty if raw values are raw disparities
  DisparityFilter filter_;
  OcclusionMemory occlusions_;
  SurfaceBuilder surface_builder_;
  SurfaceNoiseMeter noise_meter_;
};

}  // namespace hapticd::rt
