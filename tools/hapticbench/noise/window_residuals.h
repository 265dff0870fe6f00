// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/hapticbench/noise/noise_session.h"

namespace hapticd::tools {

/// A square of the image.
struct Window {
  int column = 0;
  int row = 0;
  int side_px = 0;
};

enum class WindowState : std::uint8_t {
  good,
  with_holes,
  not_smooth,
  moving,
};

/// A window's disparities in every frame without its smooth surface, raw units.
struct WindowResiduals {
  WindowState state = WindowState::with_holes;
  int side_px = 0;
  std::vector<bool> steady;                ///< per pixel: measured in every frame, and not at an edge
  std::vector<std::vector<float>> frames;  ///< per frame and pixel; 0 where not steady

  std::size_t count() const;
};

/// Returns the residuals of a window; the smooth surface is fitted to the mean over the frames.
WindowResiduals residualsOf(const NoiseSession& session, const Window& window);

/// Returns all adjacent windows with that side.
std::vector<Window> windowsOf(int side_px);

}  // namespace hapticd::tools
