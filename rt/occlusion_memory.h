// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/cache_line.h"
#include "rt/depth_frame.h"
#include "rt/depth_model.h"
#include "rt/occlusion_kernel.h"
#include "rt/scene.h"

namespace hapticd::rt {

/// What lies hidden behind the visible surface, pixel by pixel: what was last seen there before something
/// nearer came before it.
///
/// A new value that is nearer than the one before by more than the shell's depth hides what was there; once
/// that is seen again, or something behind it, nothing is hidden any more. Smaller changes are the surface's
/// own movement. If something comes before an occluder, the farther one stays remembered, unless the nearer
/// one had been there for kSettledFrames: then it belongs to the scene. A pixel that loses its measurement
/// offers its last value as hidden for kHoldFrames, and for longer as long as something nearer beside it in
/// its row casts a shadow of the projector on it.
///
/// When the camera moves, pixels no longer belong to places. Samples all over the image are compared with
/// what they showed at first: once more than kMovedShare of those that can be compared differ by more than
/// noise and less than the shell, all is forgotten, at most kStripPeriod frames (0.27 s) after the image has
/// changed so much, which is one raw unit beyond the noise. Likewise a surface that comes nearer and fills
/// the image. After kMaxGap_s without a frame all is forgotten too.
///
/// Thread: one (the scene thread).  RT: allocates nothing after construction.
class OcclusionMemory {
 public:
  /// What is less deep than that behind the visible surface is inside of it: thicker than a hand or an arm
  /// seldom is behind its visible side, thinner than the gap to what a hand passes before.
  static constexpr double kShell_m = 0.045;
  static constexpr int kHoldFrames = 10;
  static constexpr int kSettledFrames = 60;
  static constexpr int kStripPeriod = 8;
  static constexpr double kMovedShare = 0.4;
  static constexpr double kMaxGap_s = 0.5;

  explicit OcclusionMemory(const DepthModel& model);

  /// Takes in a new frame: the window's pixels at once, and of the rest of the image a strip of
  /// 1 / kStripPeriod of the rows, so that what the hand has not been near is remembered too. The same frame
  /// again (same sequence, other window) only adds pixels.
  void see(const DepthFrame& frame, const PixelWindow& window) noexcept;

  /// Raw values, in the layout of a whole frame: what lies hidden behind the visible surface of that pixel;
  /// kRawNoMeasurement where nothing is hidden or known. Valid in the windows that the newest frame was seen
  /// with.
  const std::uint16_t* hidden() const noexcept { return pixels_->hidden; }
  /// True if hidden() has any value near the window, at most kTile columns beside it.
  bool hidesAnything(const PixelWindow& window) const noexcept;

  /// The next frame is the first one.
  void forget() noexcept;

 private:
  static constexpr std::size_t kTile = kOcclusionTile;
  static constexpr std::size_t kTilesAcross = kFrameWidth / kTile;
  static_assert(kTilesAcross * kTile == kFrameWidth);

  static constexpr std::size_t kStripRows = kFrameHeight / kStripPeriod;
  static_assert(kStripRows * kStripPeriod == kFrameHeight);

  /// Samples of a strip when it was last compared.
  struct Samples {
    std::uint32_t comparable = 0;
    std::uint32_t moved = 0;
  };
  /// Pixels side by side without measurement, and whether something nearer beside them casts a shadow.
  struct Gap {
    std::size_t begin = 0;
    std::size_t end = 0;
    std::uint16_t nearest_beside = 0;  ///< nearness key, see nearnessOf()
  };

  /// Of a whole frame.
  struct Pixels {
    alignas(kCacheLine) std::uint16_t visible[kFramePixels];  ///< see OcclusionRow
    alignas(kCacheLine) std::uint16_t hidden[kFramePixels + kVectorPadding];
    /// Frame, its low 16 bits, since which the pixel has shown the surface that it shows, or nothing.
    alignas(kCacheLine) std::uint16_t since[kFramePixels];
  };

  bool cameraMoved(const DepthFrame& frame) noexcept;
  void compare(const DepthFrame& frame, std::size_t row, Samples& samples) noexcept;
  void seeRow(const DepthFrame& frame, std::size_t row, std::size_t column_first,
              std::size_t column_last) noexcept;
  void dropOverdue(const OcclusionRow& row, std::size_t column_first, Gap& gap) noexcept;
  bool inShadow(const std::uint16_t* raw_row, std::size_t column, std::uint16_t raw, Gap& gap) const noexcept;
  bool rowHides(std::size_t row) const noexcept;
  void startRow(std::size_t row) noexcept;

  /// Raw values in the order of depth, whichever sign the camera's coefficient has; small is near.
  std::uint16_t nearnessOf(std::uint16_t raw) const noexcept {
    return falls_ ? static_cast<std::uint16_t>(kRawNoMeasurement - 1 - raw) : raw;
  }
  /// By more than the shell.
  bool isNearer(std::uint16_t raw, std::uint16_t than_raw) const noexcept {
    return nearnessOf(raw) < shell_end_[nearnessOf(than_raw)];
  }

  std::unique_ptr<Pixels> pixels_;
  bool falls_;                                       ///< depth falls where raw rises
  std::array<std::uint16_t, kRawValues> shell_end_;  ///< by nearness: nearer ones are before the shell
  std::array<std::uint8_t, kFrameHeight * kTilesAcross> hidden_of_tile_{};
  std::array<Samples, kStripPeriod> samples_of_strip_{};
  /// What the first pixel of each tile showed at first, or kNothingSeen.
  std::array<std::uint16_t, kFrameHeight * kTilesAcross> first_shown_{};
  std::array<std::uint32_t, kFrameHeight> epoch_of_row_{};  ///< rows of an older one are to be started anew
  std::uint32_t epoch_ = 1;
  std::uint32_t hidden_count_ = 0;
  std::uint64_t newest_ = 0;  ///< frame; 0: none
  std::int64_t newest_ns_ = 0;
  std::uint16_t now_ = 0;
  std::size_t newest_strip_ = kStripPeriod;  ///< the one seen of the newest frame, or kStripPeriod: none
};

}  // namespace hapticd::rt
