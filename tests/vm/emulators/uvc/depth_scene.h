// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tests/vm/emulators/uvc/camera_model.h"

namespace hapticd::test::uvc {

/// A tilted plane and a sphere that moves before it, as exact depth values. The frame's number stands in the
/// low four bits of the first eight pixels, so that every pixel of a frame that has arrived can be checked
/// without knowing which frame it is.
/// Camera frame: x right, y down, z forward; metres. Plane: z + 0.25 x + 0.1 y = 0.6. Sphere: radius 0.06 m,
/// centre (-0.07 + 0.02 p, 0.01, 0.45) with p the frame's number modulo 8.
class DepthScene {
 public:
  static constexpr std::uint32_t kPhases = 8;

  /// unit_um: 10 to 25000.
  DepthScene(std::uint16_t width_px, std::uint16_t height_px, const Intrinsics& intrinsics,
             std::uint32_t unit_um);

  /// Pixels of a frame.
  std::size_t pixels() const { return std::size_t{width_px_} * height_px_; }
  /// The depth value of a pixel, without the frame's number.
  std::uint16_t value(std::uint16_t column, std::uint16_t row, std::uint32_t number) const;
  /// Writes frame `number` with its number; frame: pixels().
  void write(std::uint32_t number, std::span<std::uint16_t> frame) const;

 private:
  std::uint16_t stepsOf(double depth_m) const;
  double x(std::uint16_t column) const;
  double y(std::uint16_t row) const;
  std::vector<std::uint16_t> plane() const;
  void addSphere(std::uint32_t phase, std::vector<std::uint16_t>& image) const;

  std::uint16_t width_px_;
  std::uint16_t height_px_;
  Intrinsics intrinsics_;
  double steps_per_m_;
  std::vector<std::vector<std::uint16_t>> phases_;
};

/// The number that stands in a frame of DepthScene; frame: at least 8 pixels.
std::uint32_t frameNumberIn(std::span<const std::uint16_t> frame);
void putFrameNumber(std::span<std::uint16_t> frame, std::uint32_t number);

}  // namespace hapticd::test::uvc
