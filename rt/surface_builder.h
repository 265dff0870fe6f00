// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "rt/block_image.h"
#include "rt/column_shifts.h"
#include "rt/depth_frame.h"
#include "rt/depth_model.h"
#include "rt/facet_fit.h"
#include "rt/parameters.h"
#include "rt/visible_surface.h"

namespace hapticd::rt {

/// Turns depth frames into the visible surface around a place, in a fixed amount of memory.
///
/// Pixels are joined to blocks, blocks of a resting surface become means over the last frames, and facets are
/// fitted to them with as much support as is flat (fitFacets()). Where the surface near the focus moves, its
/// velocity is estimated from the innovations of all its blocks (an alpha-beta filter); the means are carried
/// along, over fewer frames, and the facets say how they go on. Thread: one (the scene thread).  RT: build()
/// allocates nothing, its cost is bounded by the pixels of a frame.
class SurfaceBuilder {
 public:
  /// `model` outlives the builder.
  explicit SurfaceBuilder(const DepthModel& model);

  /// The pixels that build() reads; may be empty.
  PixelWindow windowOf(const Vec3& centre_m_in_world, double radius_m) const noexcept;

  /// Fills `surface`, which is attached to memory, for a focus at `centre_m_in_world`. `hidden`: what lies
  /// behind the visible surface (OcclusionMemory::hidden()); null: nothing is known. The same frame may be
  /// built again around another place.
  void build(const DepthFrame& frame, const std::uint16_t* hidden, const Vec3& centre_m_in_world,
             double radius_m, const SurfaceParameters& parameters, VisibleSurface& surface) noexcept;

  /// The next frame is taken for the first one.
  void forget() noexcept {
    sequence_ = 0;
    column_shifts_.forget();
  }

  /// The sensor's noise in the mean of a block of one frame, raw units. Measured on recordings of three
  /// devices: 0.5 to 0.6, most of it a pattern that stands still, so that it does not become less by
  /// averaging over time.
  static constexpr double kNoise_raw = 0.5;

 private:
  /// What is remembered of the blocks of a layer.
  struct BlockMeans {
    std::unique_ptr<float[]> disparity;
    std::unique_ptr<float[]> frames;           ///< that it is a mean over
    std::unique_ptr<std::uint32_t[]> updated;  ///< with that frame

    BlockMeans();
  };
  /// How a frame is looked at.
  struct Job {
    PixelWindow pixels;
    BlockWindow sites;    ///< where facets are wanted
    BlockWindow support;  ///< what they are fitted to
    double depth_m;       ///< of the focus
    double raw_per_px;    ///< of a surface at 45 degrees to the view
    FacetFit fit;
  };
  /// The part of the image that shows the surface at the focus.
  struct Region {
    BlockWindow blocks;
    float disparity_least;
    float disparity_greatest;
    bool has(int row, int column, float disparity) const noexcept {
      return disparity >= disparity_least && disparity <= disparity_greatest && row >= blocks.row_first &&
             row <= blocks.row_last && column >= blocks.column_first && column <= blocks.column_last;
    }
  };

  Job jobFor(const Vec3& centre_m_in_world, double radius_m) const noexcept;
  Region regionAround(const Vec3& centre_m_in_world) const noexcept;
  void beginFrame(const DepthFrame& frame, const SurfaceParameters& parameters) noexcept;
  void buildLayer(BlockMeans& means, const Job& job, const Region& region, SurfaceLayer& layer) noexcept;
  void follow(BlockMeans& means, const Job& job, const Region& region) noexcept;
  void estimateMotion() noexcept;
  void fit(const BlockMeans& means, const Job& job, const Region& region, SurfaceLayer& layer) noexcept;
  void startHidden(const Job& job) noexcept;

  const DepthModel& model_;
  ColumnShifts column_shifts_;
  GapLimits gaps_{};
  BlockMeans visible_;
  BlockMeans hidden_;
  std::unique_ptr<float[]> observed_;
  std::unique_ptr<std::uint8_t[]> is_full_;
  std::unique_ptr<float[]> fit_blocks_;
  FacetMemory fit_memory_;

  // Of the newest frame.
  std::uint32_t sequence_ = 0;  ///< 0: none
  std::uint32_t before_ = 0;    ///< the one that it goes on from; 0: none
  std::int64_t arrival_ns_ = 0;
  double period_s_ = 0;
  float most_frames_ = 1;

  // Motion of the surface at the focus, raw units per second.
  double rate_ = 0;       ///< estimated
  double moving_ = 0;     ///< 0: it rests, 1: it surely moves
  double used_rate_ = 0;  ///< moving_ * rate_
  double innovation_sum_ = 0;
  int innovations_ = 0;
};

}  // namespace hapticd::rt
