// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "rt/modelling/focus/focus_samples.h"
#include "rt/modelling/focus/misfit.h"
#include "rt/scene/focus_corner.h"

namespace hapticd::rt {

/// Fits two or three planes that meet near the focus to the pixels around it. In turn, each pixel is assigned
/// to the plane that is farthest or nearest there, and each plane is fitted to its pixels (Magnani and Boyd
/// 2009, "Convex piecewise-linear fitting"). Of windows of growing size, each counts as far as the residuals
/// of its cells look like noise.
///
/// Thread: one (the scene thread).  RT: safe after the first call.  Cost: bounded; usually 3 passes over 550
/// pixels, and 20 in one of four frames where there may be a corner but is none.
class CornerFit {
 public:
  /// Indices of windows.
  struct Search {
    std::size_t least;  ///< the narrowest one that is looked at
    std::size_t first;  ///< where nothing is known from the frame before; at least `least`
  };
  /// Returns the corner at the focus; without faces if there is none.
  /// `at_focus_raw`: about the disparity of the surface there; `moved`: since the frame before. `samples` is
  /// working memory.
  FocusCorner fit(const FocusImage& image, const Search& search, double at_focus_raw,
                  const DisparityMotion& moved, FocusSamples& samples) noexcept;

  /// Forgets the frames before.
  void forget() noexcept {
    last_ = {};
    wait_frames_ = 0;
  }
  /// Forgets the corner that was found: something else explains the pixels better.
  void reject() noexcept {
    last_ = {};
    wait_frames_ = kWait_frames;
  }

 private:
  /// Number of frames between two searches for a corner where there was none.
  static constexpr int kWait_frames = 3;

  /// What is known of a window from the frames before.
  struct Window {
    double frames = 0;  ///< number of frames in the means; 0: none
    FocusCorner mean;   ///< of the fits
    Misfit misfit;      ///< mean
  };
  /// The fit in one window.
  struct Trial {
    FocusCorner fitted;
    double agrees = 0;  ///< see Misfit::agreement()
  };
  Trial tryWindow(const FocusImage& image, std::size_t window, double at_focus_raw, const FocusCorner& start,
                  FocusSamples& samples) noexcept;
  FocusCorner combined(const FocusImage& image, std::span<const Trial> trials, std::size_t base) noexcept;

  FocusCorner last_;        ///< the fit to the newest frame
  std::size_t window_ = 0;  ///< of last_
  std::array<Window, FocusImage::kWindows> windows_;
  int wait_frames_ = 0;  ///< until a corner is looked for again
};

}  // namespace hapticd::rt
