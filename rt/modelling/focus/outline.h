// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "rt/modelling/focus/body_kernel.h"
#include "rt/modelling/focus/focus_samples.h"
#include "rt/scene/focus_body.h"

namespace hapticd::rt {

/// The outline of a body that ends within a window of the image: on both sides, as a rod does, or all around.
/// If the body is round, the outline tells how strongly it is curved, long before the depths do.
struct BodyOutline {
  double share = 0;      ///< 0 to 1: how certain it is that the body ends there in front of something farther
  double across_px = 0;  ///< half the width
  double along_px = 0;   ///< half the length
  double along_x = 1;    ///< unit vector along the body in the image
  double along_y = 0;
  double ends_share = 0;  ///< 0 to 1: how certain it is that the body ends along its length too

  /// Finds the outline of `body`, to which the samples of `equations` were compared. Its size is that of the
  /// ellipse or strip with the second moments of the samples that belong to it; beside it the pixels decide.
  /// `stride_px`: distance of the samples; `radius_px`: of their window.
  /// RT: safe.  Cost: bounded, some 300 pixels; none for bodies that fill the window.
  static BodyOutline of(const FocusImage& image, const FocusBody& body, const BodyMeasure& measure,
                        const BodyEquations& equations, int stride_px, double radius_px) noexcept;
};

}  // namespace hapticd::rt
