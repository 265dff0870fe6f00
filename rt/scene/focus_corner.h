// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include "rt/scene/disparity_motion.h"

namespace hapticd::rt {

/// The surface near the focus where two or three flat faces meet in edges that are all convex or all concave:
/// along each ray it is that of the faces' planes which is farthest or nearest.
/// Disparities are in raw units, (du, dv) an offset from the focus in the image, pixels.
struct FocusCorner {
  static constexpr int kMaxFaces = 3;

  /// A plane: its disparity is linear in the image.
  struct Face {
    double disparity = 0;  ///< at the focus
    double per_column = 0;
    double per_row = 0;

    double at(double du, double dv) const noexcept { return disparity + per_column * du + per_row * dv; }
  };

  int faces = 0;          ///< 0: there is no corner
  bool greatest = false;  ///< the largest disparity counts, otherwise the smallest
  Face face[kMaxFaces];
  double column_px = 0;  ///< of the focus
  double row_px = 0;
  double radius_px = 0;        ///< up to this distance from the focus the corner is known
  double share = 0;            ///< 0 to 1: how well the pixels agree with it
  DisparityMotion per_second;  ///< change of the disparity due to motion
  double tolerance_raw = 0;    ///< a pixel within this of the corner belongs to it

  /// Returns the same corner relative to another focus.  RT: safe.
  FocusCorner movedTo(double to_column_px, double to_row_px) const noexcept {
    FocusCorner moved = *this;
    for (Face& of : moved.face) of.disparity = of.at(to_column_px - column_px, to_row_px - row_px);
    moved.column_px = to_column_px;
    moved.row_px = to_row_px;
    return moved;
  }
  /// Returns the face that the ray meets; there must be one.  RT: safe.
  const Face& faceAt(double du, double dv) const noexcept {
    const Face* met = face;
    double disparity = met->at(du, dv);
    for (int i = 1; i < faces; ++i) {
      const double other = face[i].at(du, dv);
      if ((other > disparity) != greatest) continue;
      met = face + i;
      disparity = other;
    }
    return *met;
  }
};
static_assert(std::is_trivially_copyable_v<FocusCorner>);

}  // namespace hapticd::rt
