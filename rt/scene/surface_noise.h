// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// How much the modelled surface next to the focus changes from frame to frame, as measured.
struct SurfaceNoise {
  /// Standard deviation, over 1 s of frames, of the resting surface's distance from a fixed place; 0: not
  /// known, or none.
  double noise_m = 0;
  double step_m = 0;          ///< mean absolute change of that distance per frame, motion included
  double frame_period_s = 0;  ///< 0: not known
  std::uint32_t frames = 0;   ///< number of frames that noise_m rests on; 0: not known
};

/// Measures the noise of the modelled surface next to the focus, as a force law sees it: at a fixed image
/// position the distance of the surface from a fixed place, frame by frame.
///
/// The place is kept while the focus stays near it. When the focus moves on, measuring starts again there;
/// until that has taken a second, the last result is scaled with the noise of the camera's pixels. Laws on
/// the visible surface are measured on its facets after the fusion of frames, laws on points by the mean of a
/// patch of raw values after the filter.
/// Thread: one (the scene thread).  RT: safe.
class SurfaceNoiseMeter {
 public:
  /// `model` outlives the meter.
  explicit SurfaceNoiseMeter(const DepthModel& model) noexcept : model_(model) {}

  /// Number of frames over which the deviation is taken: 1 s at 30 Hz.
  static constexpr std::size_t kWindow = 30;

  /// Measures a frame's visible surface. `moves`: it is moving, so it tells nothing about the noise. A frame
  /// measured before is ignored.
  void measure(const DepthFrame& frame, const VisibleSurface& surface, const Vec3& focus_m_in_world,
               bool moves) noexcept;

  /// Measures the raw values of a frame after the filter; those in `window` are valid.
  void measure(const DepthFrame& frame, const std::uint16_t* raw, const PixelWindow& window,
               const Vec3& focus_m_in_world) noexcept;

  const SurfaceNoise& result() const noexcept { return result_; }

  /// Treats the next frame as the first one.
  void forget() noexcept;

 private:
  /// The surface at the measured image position in one frame.
  struct Sample {
    bool found = false;
    double distance_m = 0;  ///< of `place_` from the surface
    double depth_m = 0;     ///< of the surface, along the optical axis
    bool moves = false;
  };
  bool beginFrame(const DepthFrame& frame, const Vec3& focus_m_in_world) noexcept;
  bool isNear(const Vec3& focus_in_camera) const noexcept;
  void placeAt(const Vec3& focus_in_camera) noexcept;
  Sample sampleSurface(const SurfaceView& view, const BlockWindow& blocks) const noexcept;
  Sample samplePatch(const std::uint16_t* raw, const PixelWindow& window) const noexcept;
  void take(const Sample& sample) noexcept;
  void miss() noexcept;
  void restart() noexcept;
  double noiseGrowth() const noexcept;
  void addToVariance() noexcept;

  const DepthModel& model_;
  SurfaceNoise result_;

  std::uint64_t sequence_ = 0;  ///< of the newest frame; 0: none
  std::int64_t arrival_ns_ = 0;
  std::uint32_t successive_ = 0;  ///< number of successive frames
  std::int64_t found_ns_ = 0;     ///< arrival of the newest frame with a surface

  // The place of measurement, in the camera's frame.
  bool placed_ = false;
  Vec3 place_;
  ImagePosition image_{};
  double depth_m_ = 0;  ///< of the surface in the newest frame

  std::array<double, kWindow> distance_m_{};  ///< ring of the newest distances
  std::size_t distances_ = 0;                 ///< number of valid ones since measuring started here
  double last_m_ = 0;                         ///< the newest of them
  bool has_last_ = false;
  int moving_frames_ = 0;  ///< number of successive frames that showed motion

  double variance_m2_ = 0;        ///< mean over the windows
  double variance_depth_m_ = 0;   ///< depth that it applies to
  Vec3 variance_place_in_world_;  ///< where it was measured
  std::uint32_t windows_ = 0;     ///< 0: not known
  std::uint32_t steps_ = 0;
};

}  // namespace hapticd::rt
