// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/modelling/focus/focus_samples.h"
#include "rt/modelling/focus/misfit.h"
#include "rt/scene/focus_body.h"

namespace hapticd::rt {

/// Sums over the samples that belong to a body, of their positions from the focus in pixels.
struct BodyExtent {
  double x = 0, y = 0;
  double xx = 0, xy = 0, yy = 0;
};

/// The linear least-squares problem of a body's six parameters: the disparity at the focus in raw units, two
/// rotations of the normal (about e2 and e1) and the three tangential curvatures.
struct BodyEquations {
  static constexpr int kParameters = 6;
  static constexpr int kProducts = kParameters * (kParameters + 1) / 2;

  double products[kProducts];  ///< upper triangle of the normal matrix, row by row
  double residuals[kParameters];
  FitSums sums;       ///< samples beside the body: within BodyMeasure::beside_raw
  BodyExtent extent;  ///< of the samples that belong to the body
};

/// How disparities belong to a body.
struct BodyMeasure {
  double focal_x_px;
  double focal_y_px;
  double a_per_m;  ///< of DisparityScale
  double b_per_m;
  double tolerance_raw;  ///< samples that differ by more do not belong to the body
  double beside_raw;     ///< those that differ by less than this belong to something that touches it
};

/// Sets up the equations of `body` for the samples, each weighted by (1 - (residual / tolerance)^2)^2.
/// RT: safe after the first call.  Cost: proportional to the number of samples.
BodyEquations equationsOf(const FocusSamples& samples, const FocusBody& body,
                          const BodyMeasure& measure) noexcept;

}  // namespace hapticd::rt
