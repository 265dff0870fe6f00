#pragma once

#include <cstdint>
#include <memory>

#include "rt/depth_model.h"
#include "rt/parameters.h"
#include "rt/surface_field.h"
#include "rt/surface_kernel.h"

namespace hapticd::rt {

/// Turns disparities into the signed distance field around a place, in a fixed amount of memory.
///
/// The pixels are joined to blocks of about a quarter of a voxel, each block and its neighbours to a plane,
/// and a node gets its distance from the plane that its ray meets. With Z the node's depth and 1/Z linear in
/// the pixel on the plane, that distance is (1 - Z * (1/Z of the plane)) * (the camera's distance from the
/// plane): exact on planes of any tilt, and zero exactly on the surface everywhere. Thread: one (the scene
/// thread).  RT: build() allocates nothing.
class SurfaceFieldBuilder {
 public:
  /// `model` outlives the builder.
  explicit SurfaceFieldBuilder(const DepthModel& model);

  /// Largest radius around a centre that a field with this voxel edge can cover.
  static double largestRadius_m(double voxel_edge_m) noexcept { return kLargestRadius_voxels * voxel_edge_m; }

  /// The pixels that build() reads; may be empty.
  PixelWindow windowOf(const Vec3& centre_m_in_world, double radius_m, double voxel_edge_m) const noexcept;

  /// Fills `field`, which is attached to memory, around `centre_m_in_world`; `radius_m` is cut to
  /// largestRadius_m(). `disparity`: as of DisparityFilter::apply() for windowOf(). `frame`: its number; the
  /// same frame may be built again around another place.
  void build(const float* disparity, const Vec3& centre_m_in_world, double radius_m,
             const SurfaceParameters& parameters, std::uint64_t frame, SurfaceField& field) noexcept;

  /// The next field is fused with none before.
  void forget() noexcept { fused_frame_ = 0; }

 private:
  // Of 32 nodes; a sample reads one node before and two after it, and the window's middle is a rounded place.
  static constexpr double kLargestRadius_voxels = 13.4;

  void place(const Vec3& centre_m_in_world, double radius_m, double voxel_edge_m,
             SurfaceField& field) const noexcept;
  void joinPixels(const float* disparity, const PixelWindow& window, const SurfaceField& field) noexcept;
  void fillFromPatches(SurfaceField& field) const noexcept;
  void fillFree(SurfaceField& field) const noexcept;
  void fuse(const SurfaceParameters& parameters, std::uint64_t frame, SurfaceField& field) noexcept;

  const DepthModel& model_;
  BlockImage image_{};
  std::unique_ptr<float[]> column_sum_;
  std::unique_ptr<float[]> column_count_;
  std::unique_ptr<float[]> block_count_;
  std::unique_ptr<float[]> block_mean_;
  std::unique_ptr<SurfacePatch[]> patch_;

  // What the fusion remembers of the frame before.
  std::unique_ptr<float[]> fused_distance_m_;
  std::unique_ptr<std::uint16_t[]> fused_frames_;
  SurfaceField fused_field_;       // that those distances are of
  std::uint64_t fused_frame_ = 0;  // 0: nothing
  std::unique_ptr<float[]> next_distance_m_;
  std::unique_ptr<std::uint16_t[]> next_frames_;
};

}  // namespace hapticd::rt
