// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/focus/outline.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "rt/scene/visible_surface.h"

namespace hapticd::rt {
namespace {

/// Where a body reaches farther towards the window's border, the window cuts it.
constexpr double kRoom = 0.8;
constexpr double kNoRoom = 0.95;
/// What is less than this times as wide as it is long is a strip, up to where it counts as a disc.
constexpr double kStrip = 0.5;
constexpr double kDisc = 0.65;
/// Share of the outline's area in which samples may be missing.
constexpr double kMissing = 0.25;
constexpr double kTooManyMissing = 0.4;
/// Share of the lines across an outline that must meet something farther behind it.
constexpr double kFarther = 0.6;
constexpr double kTooFewFarther = 0.3;

/// Reads the pixels beside a body.
struct Beside {
  const FocusImage& image;
  const FocusBody& body;
  const BodyMeasure& measure;
  double deeper_raw;  ///< what is this much farther than the body's middle is behind its outline

  /// Returns whether the first measured pixel on the way from (x, y), beside the outline, into the direction
  /// (to_x, to_y), all from the focus, is farther than the body at (at_x, at_y).
  bool isFarther(double x, double y, double to_x, double to_y, double at_raw) const noexcept {
    constexpr int kReach_px = 12;  // more than the shadow of a body 0.3 m before a wall, at 2 m
    for (int i = 0; i < kReach_px; ++i) {
      const auto column = static_cast<int>(std::lround(image.column_px + x + i * to_x));
      const auto row = static_cast<int>(std::lround(image.row_px + y + i * to_y));
      if (column < image.pixels.column_first || column > image.pixels.column_last ||
          row < image.pixels.row_first || row > image.pixels.row_last)
        return false;
      const std::uint16_t raw = image.image[row * image.stride_px + column];
      if (raw >= kNoRawDisparity) continue;
      const double shift = static_cast<double>(image.column_shift_raw[column / BlockLattice::kBlock_px]);
      const double farther_raw = (raw - shift - at_raw) * (measure.a_per_m < 0 ? 1 : -1);
      return farther_raw > deeper_raw;
    }
    return false;
  }
  /// Returns the disparity of the body, raw units; negative where it is not met.
  double bodyAt(double x, double y) const noexcept {
    const FocusBody::Crossing there = body.crossing(x / measure.focal_x_px, y / measure.focal_y_px);
    if (!there.exists) return -1;
    return (body.inverse_depth_per_m / there.stretch - measure.b_per_m) / measure.a_per_m;
  }
};

/// Returns 1 if so large a share of `lines` ends in front of something farther that there is an outline.
double outlineShare(int farther, int lines) noexcept {
  return 1 - fallingStep(static_cast<double>(farther) / lines, kTooFewFarther, kFarther);
}

}  // namespace

BodyOutline BodyOutline::of(const FocusImage& image, const FocusBody& body, const BodyMeasure& measure,
                            const BodyEquations& equations, int stride_px, double radius_px) noexcept {
  BodyOutline outline;
  const double count = equations.sums.explained;
  const double area_px2 = count * stride_px * stride_px;
  if (area_px2 < FocusImage::kLeastPixels) return outline;
  const BodyExtent& e = equations.extent;
  const double x = e.x / count;
  const double y = e.y / count;
  // The samples stand for squares as wide as their distance.
  const double of_sample = stride_px * stride_px / 12.0;
  const double xx = e.xx / count - x * x + of_sample;
  const double yy = e.yy / count - y * y + of_sample;
  const double xy = e.xy / count - x * y;
  const double middle = 0.5 * (xx + yy);
  const double half = std::hypot(0.5 * (xx - yy), xy);
  const double turn = 0.5 * std::atan2(2 * xy, xx - yy);
  outline.along_x = std::cos(turn);
  outline.along_y = std::sin(turn);
  // A strip has a third of the square of half its width as second moment across, a disc a quarter.
  const double roundness = (middle - half) / (middle + half);
  outline.across_px = std::sqrt((3 + roundness) * (middle - half));
  outline.along_px = std::sqrt((3 + roundness) * (middle + half));
  const double off_across = std::abs(outline.along_x * y - outline.along_y * x);
  const double off_along = std::abs(outline.along_x * x + outline.along_y * y);
  const double full_px2 = (4 - (4 - std::numbers::pi) * roundness) * outline.across_px * outline.along_px;
  const double share = fallingStep((off_across + outline.across_px) / radius_px, kRoom, kNoRoom) *
                       fallingStep(1 - area_px2 / full_px2, kMissing, kTooManyMissing);
  if (!(share > 0)) return outline;

  const Beside beside{
      .image = image,
      .body = body,
      .measure = measure,
      .deeper_raw = measure.tolerance_raw + outline.across_px / (image.px_per_m * image.unit_m)};
  // Lines outwards from an outline a little larger than it seems: sensors miss pixels there.
  constexpr double kSpread = 0.6;
  constexpr int kLines = 7;
  const auto shareBeyond = [&](double to_x, double to_y, double reach_px, double spread_px) {
    int farther = 0;
    for (int i = 0; i < kLines; ++i) {
      const double aside = spread_px * (2.0 * i / (kLines - 1) - 1);
      const double at_x = x - aside * to_y;
      const double at_y = y + aside * to_x;
      const double at_raw = beside.bodyAt(at_x, at_y);
      const double from_px = 1.15 * reach_px + 1.5;
      if (at_raw > 0 && beside.isFarther(at_x + from_px * to_x, at_y + from_px * to_y, to_x, to_y, at_raw))
        ++farther;
    }
    return outlineShare(farther, kLines);
  };
  const double across_x = -outline.along_y;
  const double across_y = outline.along_x;
  const double sides =
      std::min(shareBeyond(across_x, across_y, outline.across_px, kSpread * outline.along_px),
               shareBeyond(-across_x, -across_y, outline.across_px, kSpread * outline.along_px));
  const double strip = fallingStep(outline.across_px / outline.along_px, kStrip, kDisc);
  outline.ends_share =
      fallingStep((off_along + outline.along_px) / radius_px, kRoom, kNoRoom) *
      std::min(
          shareBeyond(outline.along_x, outline.along_y, outline.along_px, kSpread * outline.across_px),
          shareBeyond(-outline.along_x, -outline.along_y, outline.along_px, kSpread * outline.across_px));
  outline.share = share * sides * std::max(strip, outline.ends_share);
  return outline;
}

}  // namespace hapticd::rt
