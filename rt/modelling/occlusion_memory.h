// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "hwy/aligned_allocator.h"
#include "rt/base/cache_line.h"
#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_image.h"
#include "rt/modelling/occlusion_kernel.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {

/// Remembers, for each pixel, the surface hidden behind the visible one: what was last seen there before
/// something nearer moved in front.
///
/// A new value that is nearer than the previous one by more than the shell's depth hides what was there; once
/// that surface, or something behind it, is seen again, nothing is hidden any more. Smaller changes are
/// motion of the surface itself. If something moves in front of an occluder, the farthest surface stays
/// remembered, unless the nearer one has been visible for kSettledFrames: then it is part of the scene. A
/// pixel that loses its measurement offers its last value as hidden for kHoldFrames, and longer while
/// something nearer beside it in its row casts the projector's shadow on it.
///
/// When the camera moves, pixels no longer correspond to fixed places. Samples all over the image are
/// compared with their first values: if more than kMovedShare of the comparable samples differ by more than
/// noise and less than the shell, everything is forgotten, at most as many frames as the image has strips
/// (Kinect: 8, 0.27 s) after the image has changed by one raw unit more than noise. The same happens when a
/// surface comes nearer and fills the image. After kMaxGap_s without a frame everything is forgotten as well.
///
/// Thread: one (the scene thread).  RT: allocates nothing after construction.
class OcclusionMemory {
 public:
  /// Depth behind the visible surface up to which a place counts as part of the same body: more than the
  /// usual thickness of a hand or arm, less than the usual gap between a hand and what it passes in front of.
  static constexpr double kShell_m = 0.045;
  /// Number of frames for which a pixel without measurement offers its last value as hidden.
  static constexpr int kHoldFrames = 10;
  /// Number of frames after which a visible surface belongs to the scene.
  static constexpr int kSettledFrames = 60;
  /// Each frame updates a strip of rows with at most this many pixels, so that its cost does not grow with
  /// the size of the image; the whole image is updated strip by strip.
  static constexpr int kStripPixels = 38400;
  /// Fraction of changed samples above which the camera is assumed to have moved.
  static constexpr double kMovedShare = 0.4;
  /// Longest time between two frames that are compared.
  static constexpr double kMaxGap_s = 0.5;

  /// Allocates all images.  RT: not safe.
  explicit OcclusionMemory(const DepthModel& model);

  /// Updates the memory with a new frame: the window's pixels at once and, of the rest of the image, one
  /// strip of rows, so that places away from the hand are remembered too. Pixels of both are valid in
  /// `frame`. The same frame again (same sequence number, other window) only adds pixels.
  void update(const DisparityFrame& frame, const PixelWindow& window) noexcept;
  /// Returns the strip that a frame updates; without a range of raw values.
  PixelWindow stripOf(std::uint64_t sequence) const noexcept;

  /// Returns raw values in frame layout: the surface hidden behind the visible one at each pixel, or
  /// kNoRawDisparity where nothing is hidden or known. Valid in the windows with which the newest frame was
  /// processed.
  const std::uint16_t* hidden() const noexcept { return hidden_.get(); }
  /// Returns true if hidden() has any value in the window or at most kTile columns beside it.
  bool hidesAnything(const PixelWindow& window) const noexcept;

  /// Forgets everything; the next frame is treated as the first one.
  void forget() noexcept;

 private:
  static constexpr std::size_t kTile = kOcclusionTile;
  static_assert(kTile == kRowAlignment_px);

  /// Result of the last comparison of a strip's samples.
  struct Samples {
    std::uint32_t comparable = 0;
    std::uint32_t moved = 0;
  };
  bool cameraMoved(const DisparityFrame& frame) noexcept;
  void compare(const DisparityFrame& frame, std::size_t row, Samples& samples) noexcept;
  void updateRows(const DisparityFrame& frame, const PixelWindow& window) noexcept;
  bool isMeasured(std::uint16_t raw) const noexcept { return raw <= last_raw_; }
  void startRow(std::size_t row) noexcept;

  /// Maps raw values to nearness keys, ordered by depth for either sign of the camera's coefficient; small is
  /// near.
  std::uint16_t nearnessOf(std::uint16_t raw) const noexcept {
    return falls_ ? static_cast<std::uint16_t>(last_raw_ - raw) : raw;
  }
  /// Returns true if `raw` is nearer than `than_raw` by more than the shell.
  bool isNearer(std::uint16_t raw, std::uint16_t than_raw) const noexcept {
    return nearnessOf(raw) < shell_end_[nearnessOf(than_raw)];
  }

  std::size_t rows_;
  std::size_t stride_px_;
  std::size_t tiles_across_;
  std::size_t strip_rows_;
  bool falls_;                   ///< depth falls with rising raw value
  std::uint16_t last_raw_;       ///< see DisparityScale
  FallingTolerance rest_noise_;  ///< see OcclusionPixels
  FallingTolerance min_shell_;   ///< see OcclusionPixels
  // State of all pixels of a frame, see OcclusionPixels.
  hwy::AlignedFreeUniquePtr<std::uint16_t[]> visible_;
  hwy::AlignedFreeUniquePtr<std::uint16_t[]> hidden_;
  /// Low 16 bits of the number of the frame since which the pixel has shown its current surface, or nothing.
  hwy::AlignedFreeUniquePtr<std::uint16_t[]> since_;
  /// Indexed by nearness: smaller values are in front of the shell.
  std::unique_ptr<std::uint16_t[]> shell_end_;
  std::size_t strips_;
  std::unique_ptr<std::uint8_t[]> hidden_of_tile_;
  std::unique_ptr<Samples[]> samples_of_strip_;
  /// First value of the first pixel of each tile, or kNothingSeen.
  std::unique_ptr<std::uint16_t[]> first_shown_;
  std::unique_ptr<std::uint32_t[]> epoch_of_row_;  ///< rows with an older epoch are restarted
  std::uint32_t epoch_ = 1;
  std::uint32_t hidden_count_ = 0;
  std::uint64_t newest_ = 0;  ///< number of the newest frame; 0: none
  std::int64_t newest_ns_ = 0;
  std::uint16_t now_ = 0;
  PixelWindow newest_strip_;  ///< updated with the newest frame
};

}  // namespace hapticd::rt
