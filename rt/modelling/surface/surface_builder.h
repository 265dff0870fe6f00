// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "rt/base/parameters.h"
#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_image.h"
#include "rt/modelling/focus/body_fit.h"
#include "rt/modelling/surface/block_image.h"
#include "rt/modelling/surface/block_means.h"
#include "rt/modelling/surface/column_shifts.h"
#include "rt/modelling/surface/facet_fit.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Builds the visible surface around a place from depth frames, in a fixed amount of memory.
///
/// Pixels are grouped into blocks, blocks of a surface at rest are averaged over the last frames, and facets
/// are fitted to them with as much support as is flat (fitFacets()). Where the surface near the focus moves
/// or turns, its velocity is estimated from the innovations of all its blocks (an alpha-beta filter of each
/// of the three numbers of a DisparityMotion); the means are moved along and shortened to fewer frames, and
/// the facets include the velocity.
///
/// Thread: one (the scene thread).  RT: build() allocates nothing; its cost is bounded by the pixels of a
/// frame.
class SurfaceBuilder {
 public:
  /// `model` outlives the builder.  RT: not safe (allocates).
  explicit SurfaceBuilder(const DepthModel& model);

  /// Returns the pixels that build() reads; may be empty.
  PixelWindow windowOf(const Vec3& centre_m_in_world, double radius_m) const noexcept;

  /// Builds `surface`, which must be attached to memory, for a focus at `centre_m_in_world`. `hidden`: raw
  /// values behind the visible surface (OcclusionMemory::hidden()); null: unknown. The same frame may be
  /// built again around another place.
  void build(const DisparityFrame& frame, const std::uint16_t* hidden, const Vec3& centre_m_in_world,
             double radius_m, const SurfaceParameters& parameters, VisibleSurface& surface) noexcept;

  /// Treats the next frame as the first one.
  void forget() noexcept {
    sequence_ = 0;
    column_shifts_.forget();
    body_fit_.forget();
  }

  /// Returns working memory to the system until it is used, see rt::returnPages(). Before the first frame.
  /// RT: not safe.
  void returnUnusedMemory() noexcept { fit_memory_.returnUnused(); }

  /// Returns true if the surface at the focus of the newest frame moves.
  bool moves() const noexcept { return moving_ >= 0.5; }

  /// Standard deviation of the sensor's noise in the mean of a block of one frame, in raw units of a Kinect
  /// v1. Measured on recordings of three devices: 0.5 to 0.6, mostly a static pattern, so that averaging over
  /// time does not reduce it. Other cameras: multiplied by DepthModel::noiseScale() and by how much less of
  /// it is left in a mean where neighbouring pixels are less alike.
  static constexpr double kNoise_raw = 0.5;

 private:
  /// The part of a frame to process and how.
  struct Job {
    PixelWindow pixels;
    BlockWindow sites;    ///< blocks that get a facet
    BlockWindow support;  ///< blocks used by the fits
    double depth_m;       ///< depth of the focus
    double noise;         ///< of a pixel: DepthModel::noiseScale() at the focus
    double block_noise;   ///< of the mean of a block, relative to that of a Kinect v1
    double raw_per_px;    ///< change of disparity per pixel of a surface at 45 degrees to the view
    FacetFit fit;
  };
  Job jobFor(const Vec3& centre_m_in_world, double radius_m) const noexcept;
  /// Returns the part of the image that shows the surface at the focus.
  BlockRegion regionAround(const Vec3& centre_m_in_world) const noexcept;
  void beginFrame(const DisparityFrame& frame, const SurfaceParameters& parameters) noexcept;
  void buildLayer(BlockMeans& means, const Job& job, const BlockRegion& region, SurfaceLayer& layer) noexcept;
  BlockWindow clipped(const BlockWindow& window) const noexcept;
  void follow(BlockMeans& means, const Job& job, const BlockRegion& region) noexcept;
  void comeToRest() noexcept { rate_ = used_rate_ = {}, moving_ = 0; }
  /// `block_noise`: see Job.
  void estimateMotion(double block_noise) noexcept;
  void fit(const BlockMeans& means, const Job& job, const BlockRegion& region, SurfaceLayer& layer) noexcept;
  void startHidden(const Job& job) noexcept;
  /// Returns the body that the frame shows at the focus. `moved`: see BodyFit::Input.
  FocusBody bodyAt(const Vec3& focus_m_in_world, const Job& job, const BlockRegion& region,
                   const DisparityMotion& moved, const VisibleSurface& surface) noexcept;

  const DepthModel& model_;
  BlockLattice lattice_;
  ImageLayout layout_;
  double block_noise_;  ///< of the mean of a block by that of a pixel, relative to a Kinect v1
  ColumnShifts column_shifts_;
  GapLimits gaps_{};
  BlockMeans visible_;
  BlockMeans hidden_;
  std::unique_ptr<float[]> observed_;
  std::unique_ptr<std::uint8_t[]> is_full_;
  std::unique_ptr<float[]> fit_blocks_;
  FacetMemory fit_memory_;
  BodyFit body_fit_;
  FocusBody body_;      ///< of the newest frame, around the first place that it was built around
  FocusCorner corner_;  ///< the same

  // State of the newest frame.
  std::uint32_t sequence_ = 0;  ///< 0: none
  std::uint32_t before_ = 0;    ///< the previous frame, if it can be continued; 0: none
  std::int64_t arrival_ns_ = 0;
  double period_s_ = 0;
  float max_frames_ = 1;  ///< length of the means

  // Motion of the surface at the focus, in raw units per second.
  DisparityMotion rate_;       ///< estimate
  DisparityMotion used_rate_;  ///< each of its numbers as far as it is certainly no noise
  double moving_ = 0;          ///< 0: at rest; 1: certainly moving or turning
  Innovations innovations_;
};

}  // namespace hapticd::rt
