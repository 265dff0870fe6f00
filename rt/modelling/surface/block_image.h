// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Operations on the pixels of a depth image that precede surface estimation. They work on 16-bit raw values,
/// one vector of pixels at a time.

/// Defines which raw values are measurements and which gaps between measurements are closed.
struct GapLimits {
  std::uint16_t raw_first;         ///< first raw value that has a depth
  std::uint16_t raw_last;          ///< last raw value that has a depth
  std::uint16_t remembered_first;  ///< first raw value that is accepted from a remembered image
  std::uint16_t remembered_last;   ///< last raw value that is accepted from a remembered image
  int longest_px;                  ///< longest gap in a row that is closed
  float max_raw;                   ///< allowed difference between the two ends of a gap, ...
  float max_raw_per_px;            ///< ... plus this for each pixel of the gap; larger: two surfaces

  /// Largest difference between the value of a closed gap and a remembered one of the same surface.
  std::uint16_t same_raw() const noexcept {
    return static_cast<std::uint16_t>(std::min<float>(0.5F * max_raw, kNoRawDisparity));
  }
};

/// Size and layout of images.
struct ImageLayout {
  int width_px;
  int stride_px;  ///< distance between rows

  explicit ImageLayout(const DepthModel& model) noexcept
      : width_px(model.width_px()), stride_px(model.stride_px()) {}
  std::size_t at(int row, int column) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(stride_px) +
           static_cast<std::size_t>(column);
  }
};

/// Raw disparities in frame layout. Up to 8 pixels beyond the end of an image are read and
/// written back.
struct LayerImages {
  const std::uint16_t* raw;         ///< of a frame
  const std::uint16_t* remembered;  ///< the surface hidden behind the visible one; null: none is known
  std::uint16_t* visible;           ///< to be filled
  std::uint16_t* hidden;            ///< to be filled, where a surface is remembered
};

/// Fills the pixels of `window` in the images of both layers. Returns true if they differ.
///
/// The visible surface is what was measured, with gaps in rows closed by linear interpolation. A pixel that
/// still has no depth takes what is remembered; without that it becomes kNoRawDisparity, or
/// SurfaceLayer::kBeyondView in a gap that touches the left or right image border and is at most
/// GapLimits::longest_px long. The hidden surface is what is remembered, and elsewhere the visible one, with
/// the gaps closed that are left of it. A pixel in a closed gap that is remembered with the same value,
/// within GapLimits::same_raw(), flickers and hides nothing. RT: safe after the first call.  Cost: one pass
/// over the pixels.
bool fillLayerImages(const LayerImages& images, const ImageLayout& layout, const PixelWindow& window,
                     const GapLimits& limits) noexcept;

}  // namespace hapticd::rt
