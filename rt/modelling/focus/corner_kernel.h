// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/modelling/focus/focus_samples.h"
#include "rt/modelling/focus/misfit.h"
#include "rt/scene/focus_corner.h"

namespace hapticd::rt {

/// Sums over the samples of a face, each weighted by w, with its offset (x, y) from the focus and its
/// residual r.
struct FaceSums {
  double w, wx, wy, wxx, wxy, wyy, wr, wrx, wry;
};

struct CornerSums {
  FaceSums face[FocusCorner::kMaxFaces];  ///< beyond the corner's faces: zero
  FitSums fit;
};

/// Which of the faces a sample belongs to.
enum class FaceChoice : std::uint8_t { greatest, least, nearest };

/// Sums up the samples by faces, each weighted by (1 - (residual / tolerance_raw)^2)^2. `corner` has at least
/// one face. Samples beside it: within `beside_raw`.
/// RT: safe after the first call.  Cost: proportional to the number of samples.
CornerSums cornerSumsOf(const FocusSamples& samples, const FocusCorner& corner, FaceChoice choice,
                        double tolerance_raw, double beside_raw) noexcept;

/// Returns the choice of the corner itself.
inline FaceChoice choiceOf(const FocusCorner& corner) noexcept {
  return corner.greatest ? FaceChoice::greatest : FaceChoice::least;
}

}  // namespace hapticd::rt
