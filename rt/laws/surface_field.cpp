// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/surface_field.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Reach of the kernel, w(t) = (1 - t^2)^2 with t in this unit: four pixels average the flicker of an outline
/// and stay narrower than half of the thinnest body that is seen.
constexpr double kRadius_px = 4;
constexpr int kTaps = 8;
/// Shares beyond which an outline is farther away than the kernel reaches.
constexpr double kLeastShare = 0.001;

/// Weights of the pixels along one axis, and their derivatives by the position.
struct Taps {
  int first;  ///< pixel of the first one
  std::array<float, kTaps> weight;
  std::array<float, kTaps> slope;

  explicit Taps(double position_px) noexcept : first(static_cast<int>(std::ceil(position_px - kRadius_px))) {
    for (int i = 0; i < kTaps; ++i) {
      const double t = (first + i - position_px) / kRadius_px;
      const double rest = std::max(0.0, 1 - t * t);
      weight[static_cast<std::size_t>(i)] = static_cast<float>(rest * rest);
      slope[static_cast<std::size_t>(i)] = static_cast<float>(4 / kRadius_px * t * rest);
    }
  }
};

/// Returns the distance inside a straight outline, in units of the kernel's reach, at which the kernel's
/// share is `share`: the inverse of F(t) = 1/2 + 15/16 (t - 2/3 t^3 + t^5 / 5), by Newton's method.
double insideBy(double share) noexcept {
  const double more = std::clamp(share, kLeastShare, 1 - kLeastShare) - 0.5;
  double t = 1.2 * more;
  constexpr int kSteps = 5;
  for (int i = 0; i < kSteps; ++i) {
    const double square = t * t;
    const double rest = 1 - square;
    const double off = 0.9375 * t * (1 - square * (2.0 / 3 - 0.2 * square)) - more;
    t = std::clamp(t - off / std::max(0.9375 * rest * rest, 0.02), -1.0, 1.0);
  }
  return t;
}

}  // namespace

/// Returns whether the window around an image position may show an outline.
bool SurfaceField::hasOutline(const ImagePosition& image, bool or_hidden) const noexcept {
  constexpr double kPerBlock = 1.0 / BlockLattice::kBlock_px;
  const BlockWindow& blocks = surface_.blocks;
  if (blocks.columns() < 2 || blocks.rows() < 2) return true;
  const auto cellAt = [](double position_px, int first, int last) {
    return std::clamp(static_cast<int>(std::floor((position_px - BlockLattice::kMiddle_px) * kPerBlock)),
                      first, last - 1);
  };
  const int column_last = cellAt(image.u + kRadius_px, blocks.column_first, blocks.column_last);
  const int row_last = cellAt(image.v + kRadius_px, blocks.row_first, blocks.row_last);
  const int column_first = cellAt(image.u - kRadius_px, blocks.column_first, blocks.column_last);
  for (int row = cellAt(image.v - kRadius_px, blocks.row_first, blocks.row_last); row <= row_last; ++row) {
    for (int column = column_first; column <= column_last; ++column) {
      const std::size_t index = surface_.lattice.at(row, column);
      if (surface_.visible.cell[index] == Cell::mixed) return true;
      if (or_hidden && surface_.hidden.cell[index] == Cell::mixed) return true;
    }
  }
  return false;
}

/// Returns whether there are facets for an image position.
bool SurfaceField::isModelled(const ImagePosition& image) const noexcept {
  constexpr int kBlock_px = BlockLattice::kBlock_px;
  const BlockWindow& blocks = surface_.blocks;
  return image.u >= blocks.column_first * kBlock_px &&
         image.u < blocks.column_last * kBlock_px + kBlock_px - 1 &&
         image.v >= blocks.row_first * kBlock_px && image.v < blocks.row_last * kBlock_px + kBlock_px - 1;
}

/// Returns whether the pixel that shows an image position has no depth.
bool SurfaceField::isUnmeasured(const ImagePosition& image) const noexcept {
  if (!isModelled(image)) return false;
  const auto column = static_cast<int>(std::lround(image.u));
  const auto row = static_cast<int>(std::lround(image.v));
  return surface_.visible.image[row * model_.stride_px() + column] == kNoRawDisparity;
}

/// Returns the surface that goes on over a gap.
Sheet SurfaceField::bridgeAt(const ImagePosition& image) const noexcept {
  Sheet sheet;
  sheet.distance_m = bridge_distance_m_;
  sheet.normal_in_camera = bridge_normal_;
  sheet.inverse_depth_per_m = -dot(bridge_normal_, view_.placeAt(image, 1)) / bridge_distance_m_;
  sheet.exists = sheet.inverse_depth_per_m > 0;
  return sheet;
}

/// Follows a line from a HIP over a gap to the first pixel behind it, `image` then. Without a gap, or one
/// that is longer than `most_px`, there is no such pixel.
SurfaceField::GapEnd SurfaceField::crossGap(ImagePosition& image, const ImagePosition& step, double most_px,
                                            bool in_gap) const noexcept {
  constexpr double kAhead_px = 2;  // the gap begins no farther from the HIP, if it is not in it
  for (double px = 0; px < most_px; px += 1) {
    if (!isModelled(image)) return in_gap ? GapEnd::unknown : GapEnd::none;
    if (isUnmeasured(image)) {
      in_gap = true;
    } else if (in_gap) {
      return GapEnd::seen;
    } else if (px >= kAhead_px) {
      return GapEnd::none;
    }
    image.u += step.u;
    image.v += step.v;
  }
  return GapEnd::none;
}

void SurfaceField::bridge(const Vec3& proxy_m, const Vec3& hip_m, const Vec3& seen_m, const Vec3& normal,
                          double reach_m) noexcept {
  if (!(SurfaceView::depthOf(hip_m) > SurfaceView::kNearest_m)) return;
  const ImagePosition from = view_.project(seen_m);
  ImagePosition image = view_.project(hip_m);
  if (!isModelled(image) || !hasOutline(image, false)) return;
  const double seen_px = std::hypot(image.u - from.u, image.v - from.v);
  // Across the gap: where it begins, to where fewer pixels show the surface.
  const Share share = shareOf(image, limitAt(SurfaceView::depthOf(seen_m), shell_m_));
  const bool begins = seen_px < kRadius_px && share.value > kLeastShare;
  ImagePosition step = begins ? ImagePosition{-share.per_column, -share.per_row}
                              : ImagePosition{image.u - from.u, image.v - from.v};
  const double length = std::hypot(step.u, step.v);
  if (!(length > 0)) return;
  step = {step.u / length, step.v / length};
  // Pixels next to a gap may not count as seen.
  const double most_px = reach_m / pitch_m(seen_m) - seen_px + 2 * kRadius_px;
  const bool in_gap = !begins && isUnmeasured(view_.project(proxy_m));
  const GapEnd end = crossGap(image, step, most_px, in_gap);
  bridges_ = end == GapEnd::unknown;
  bridge_normal_ = normal;
  if (end == GapEnd::seen) {
    // Pixels next to a gap show less well how deep the surface is.
    const ImagePosition inner{image.u + kRadius_px * step.u, image.v + kRadius_px * step.v};
    const ImagePosition behind = isModelled(inner) ? inner : image;
    const Sheet sheet = view_.sheetOf(surface_.visible, behind);
    if (!sheet.exists) return;
    const Vec3 over = view_.placeAt(behind, sheet.depth_m()) - seen_m;
    const double rise_m = dot(normal, over);
    // The surface may be curved, and the slope of a facet as wrong as noise makes it over a block.
    constexpr double kCurved_m = 0.01;
    const double blocks = norm(over) / (BlockLattice::kBlock_px * pitch_m(seen_m));
    bridges_ = std::abs(rise_m) < kCurved_m + (1 + 0.5 * blocks) * noise_m(seen_m);
    const Vec3 upright = normal - (rise_m / dot(over, over)) * over;
    bridge_normal_ = (1 / norm(upright)) * upright;
  }
  bridge_distance_m_ = -dot(bridge_normal_, seen_m);
}

/// The pixels that go on the front, or are nearer: what they show may hide more of it.
SurfaceField::Limit SurfaceField::limitOf(const Sheet& front, double depth_m,
                                          double allowance_m) const noexcept {
  const DisparityScale& scale = model_.disparity();
  const DepthModelParameters& camera = model_.parameters();
  // The slopes of the tangent plane N * X = 1, as in SurfaceView.
  const double per_distance = 1 / (front.distance_m * scale.a_per_m);
  double per_column = -front.normal_in_camera.x * per_distance / camera.fx_px;
  double per_row = front.normal_in_camera.y * per_distance / camera.fy_px;
  // Steeper ones, 63 degrees, are those of an outline.
  constexpr double kSteepest = 2;
  const double slope_m = std::hypot(per_column, per_row) * scale.unit_m(front.depth_m());
  const double most_m = kSteepest * view_.pitch_m(front.depth_m());
  if (slope_m > most_m) {
    per_column *= most_m / slope_m;
    per_row *= most_m / slope_m;
  }
  const double lags_raw =
      front.extrapolated_per_m / scale.a_per_m;  // the frame's pixels do, behind the front
  return {.first = 0,
          .last = scale.rawOf(depth_m + allowance_m) - lags_raw,
          .of_plane = scale.rawOf(front.depth_m() + allowance_m) - lags_raw,
          .per_column = per_column,
          .per_row = per_row,
          .or_hidden = false};
}

/// The pixels that show a body at a depth.
SurfaceField::Limit SurfaceField::limitAt(double depth_m, double allowance_m) const noexcept {
  const DisparityScale& scale = model_.disparity();
  const double last = scale.rawOf(depth_m + allowance_m);
  return {.first = scale.rawOf(std::max(SurfaceView::kNearest_m, depth_m - shell_m_)),
          .last = last,
          .of_plane = last,
          .per_column = 0,
          .per_row = 0,
          .or_hidden = surface_.hides_anything};
}

SurfaceField::Share SurfaceField::shareOf(const ImagePosition& image, const Limit& limit) const noexcept {
  const Taps across(image.u);
  const Taps down(image.v);
  const auto first = static_cast<float>(limit.first);
  float weights = 0, weights_u = 0, weights_v = 0;
  float shown = 0, shown_u = 0, shown_v = 0, raws = 0;
  const int left = std::max(0, -across.first);
  const int right = std::min(kTaps, model_.width_px() - across.first);
  for (int j = 0; j < kTaps; ++j) {
    const int row = down.first + j;
    if (row < 0 || row >= model_.height_px()) continue;
    const int start = row * model_.stride_px() + across.first;
    const double of_row = limit.of_plane + limit.per_row * (row - image.v);
    float row_weights = 0, row_slopes = 0, row_shown = 0, row_shown_slopes = 0;
    for (int i = left; i < right; ++i) {
      const auto tap = static_cast<std::size_t>(i);
      const auto last =
          static_cast<float>(std::max(limit.last, of_row + limit.per_column * (across.first + i - image.u)));
      const std::uint16_t seen = surface_.visible.image[start + i];
      const auto raw = static_cast<float>(seen);
      bool shows = seen == kNoRawDisparity
                       ? bridges_
                       : (raw <= last || seen == SurfaceLayer::kBeyondView) && raw >= first;
      float shown_raw = seen == kNoRawDisparity ? last : raw;
      if (!shows && limit.or_hidden) {
        const std::uint16_t behind = surface_.hidden.image[start + i];
        shown_raw = static_cast<float>(behind);
        shows = behind < kNoRawDisparity && shown_raw <= last && shown_raw >= first;
      }
      row_weights += across.weight[tap];
      row_slopes += across.slope[tap];
      if (!shows) continue;
      row_shown += across.weight[tap];
      row_shown_slopes += across.slope[tap];
      raws += across.weight[tap] * down.weight[static_cast<std::size_t>(j)] * shown_raw;
    }
    const float weight = down.weight[static_cast<std::size_t>(j)];
    const float slope = down.slope[static_cast<std::size_t>(j)];
    weights += weight * row_weights;
    weights_u += weight * row_slopes;
    weights_v += slope * row_weights;
    shown += weight * row_shown;
    shown_u += weight * row_shown_slopes;
    shown_v += slope * row_shown;
  }
  if (!(shown > 0)) return {};
  const float value = shown / weights;
  return {.value = value,
          .per_column = (shown_u - value * weights_u) / weights,
          .per_row = (shown_v - value * weights_v) / weights,
          .raw = raws / shown};
}

/// Returns the front of the body that ends beside a place: that next to its outline, or, if facets there
/// belong to something else, the plane across the ray at the mean of its pixels.
Sheet SurfaceField::frontBeside(const Vec3& inside, double depth_m, double allowance_m,
                                double raw) const noexcept {
  const ImagePosition image = view_.project(inside);
  if (view_.isInImage(image)) {
    const Sheet sheet = view_.sheetNear(image, depth_m);
    if (sheet.exists && sheet.depth_m() <= depth_m + allowance_m && sheet.depth_m() >= depth_m - shell_m_)
      return sheet;
  }
  Sheet sheet;
  sheet.inverse_depth_per_m = model_.disparity().inverseDepth_per_m(raw);
  if (!(sheet.inverse_depth_per_m > 0)) return sheet;
  sheet.exists = true;
  sheet.normal_in_camera = (-1 / norm(inside)) * inside;
  sheet.distance_m = norm(inside) / SurfaceView::depthOf(inside) * sheet.depth_m();
  return sheet;
}

SurfaceLook SurfaceField::look(const Vec3& p) const HAPTICD_RT {
  SurfaceLook at{.place_m = p, .normal = {}, .sheet = {}, .own = view_.sample(p)};
  const Sheet& own = at.own.sheet;
  if (own.exists) {
    at.room_m = at.own.distance_m;
    at.normal = own.normal_in_camera;
    at.sheet = own;
  }
  const double depth_m = SurfaceView::depthOf(p);
  if (!(depth_m > SurfaceView::kNearest_m)) return at;
  const ImagePosition image = view_.project(p);
  if (!view_.isInImage(image)) return at;
  if (bridges_ && !own.exists && isUnmeasured(image)) {
    at.sheet = bridgeAt(image);
    if (!at.sheet.exists) return at;
    at.bridged = true;
    at.room_m = SurfaceView::distanceFrom(at.sheet, p);
    at.normal = at.sheet.normal_in_camera;
    return at;
  }
  // Pixels this much deeper still belong to the same front: noise, and its curvature over the kernel.
  constexpr double kCurved_m = 0.003;
  const double allowance_m = 2 * noise_m(p) + kCurved_m;
  const bool is_own = own.exists && own.depth_m() <= depth_m + allowance_m;
  if (!hasOutline(image, surface_.hides_anything && !is_own)) return at;
  const Share share =
      shareOf(image, is_own ? limitOf(own, depth_m, allowance_m) : limitAt(depth_m, allowance_m));
  if (share.value <= kLeastShare || (is_own && share.value >= 1 - kLeastShare)) return at;
  const double inside_px = kRadius_px * insideBy(share.value);
  const Vec3 ray = (1 / norm(p)) * p;
  Vec3 outward{-share.per_column, share.per_row, 0};
  outward = outward - dot(outward, ray) * ray;
  const double slope = norm(outward);
  if (!(slope > 0)) return at;
  outward = (1 / slope) * outward;
  const double pitch = view_.pitch_m(depth_m);
  const double side_m = -inside_px * pitch;
  constexpr double kInside_px = 1;  // pixels next to the outline mix body and background
  const Vec3 inside = p - (std::max(0.0, side_m) + kInside_px * pitch) * outward;
  const Sheet front = is_own ? own : frontBeside(inside, depth_m, allowance_m, share.raw);
  const double front_m = front.exists ? SurfaceView::distanceFrom(front, p) : -shell_m_;
  SurfaceLook body{.place_m = p, .normal = {}, .sheet = front, .own = at.own};
  if (side_m > 0 && front_m > 0) {
    const Vec3 from_edge = side_m * outward + front_m * front.normal_in_camera;
    body.room_m = std::hypot(side_m, front_m);
    body.normal = (1 / norm(from_edge)) * from_edge;
    body.at_side = side_m > front_m;
  } else if (front_m > side_m) {
    body.room_m = front_m;
    body.normal = front.normal_in_camera;
  } else {
    body.room_m = side_m;
    body.normal = outward;
    body.at_side = true;
  }
  // Beside the body, what its own ray shows may be nearer.
  const bool own_is_nearer = !is_own && own.exists && at.room_m < body.room_m;
  return own_is_nearer ? at : body;
}

}  // namespace hapticd::rt
