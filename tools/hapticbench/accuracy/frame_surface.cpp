// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/frame_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kSteepest = 2.2;       // tangent of the largest angle to the view within a sheet
constexpr double kRoundingSteps = 1.5;  // raw units by which neighbours may differ besides
constexpr int kSearchLevels = 7;        // down to 0.5 * 0.4^6 = 0.002 of a cell
constexpr int kSearchedAround_px = 3;   // cells around the closest pixel
constexpr int kHoleRadius_px = 8;       // a pixel without measurement takes the place of one that near

}  // namespace

Vec3 FrameSurface::pointAt(double column, double row, double disparity) const {
  return depthAt(disparity) *
         Vec3{(column - camera_.cx_px) / camera_.fx_px, -(row - camera_.cy_px) / camera_.fy_px, -1};
}

bool FrameSurface::joined(float a, float b) const {
  if (a < 0 || b < 0) return false;
  const double first = depthAt(static_cast<double>(a));
  const double second = depthAt(static_cast<double>(b));
  const double nearer = std::min(first, second);
  const double unit_m = std::abs(camera_.a_per_m) * nearer * nearer;
  return std::abs(first - second) <= kSteepest * nearer / camera_.fx_px + kRoundingSteps * unit_m;
}

/// The measured pixel nearest to where the HIP appears.
std::optional<FrameSurface::Pixel> FrameSurface::pixelInFrontOf(const Vec3& hip_m) const {
  const int column = static_cast<int>(std::lround(camera_.cx_px - camera_.fx_px * hip_m.x / hip_m.z));
  const int row = static_cast<int>(std::lround(camera_.cy_px + camera_.fy_px * hip_m.y / hip_m.z));
  std::optional<Pixel> nearest;
  int least = kHoleRadius_px * kHoleRadius_px + 1;
  for (int v = std::max(row - kHoleRadius_px, 0); v <= std::min(row + kHoleRadius_px, rt::kFrameHeight - 1);
       ++v) {
    for (int u = std::max(column - kHoleRadius_px, 0);
         u <= std::min(column + kHoleRadius_px, rt::kFrameWidth - 1); ++u) {
      const int squared = (u - column) * (u - column) + (v - row) * (v - row);
      if (squared >= least || at({u, v}) < 0) continue;
      least = squared;
      nearest = Pixel{u, v};
    }
  }
  return nearest;
}

void FrameSurface::fillSheet(Pixel start, const Window& window) {
  const auto visit = [this](Pixel pixel) {
    is_in_sheet_[static_cast<std::size_t>(pixel.row * rt::kFrameWidth + pixel.column)] = true;
    to_visit_.push_back(pixel);
  };
  to_visit_.clear();
  visit(start);
  while (!to_visit_.empty()) {
    const Pixel pixel = to_visit_.back();
    to_visit_.pop_back();
    constexpr std::array<Pixel, 4> kNeighbours{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    for (const Pixel step : kNeighbours) {
      const Pixel next{pixel.column + step.column, pixel.row + step.row};
      const bool inside = next.column >= window.column_first && next.column <= window.column_last &&
                          next.row >= window.row_first && next.row <= window.row_last;
      if (inside && !isInSheet(next) && joined(at(pixel), at(next))) visit(next);
    }
  }
}

void FrameSurface::clearSheet(const Window& window) {
  for (int v = window.row_first; v <= window.row_last; ++v) {
    const auto row = is_in_sheet_.begin() + v * rt::kFrameWidth;
    std::fill(row + window.column_first, row + window.column_last + 1, false);
  }
}

FrameSurface::Pixel FrameSurface::closestPixel(const Vec3& hip_m, const Window& window) const {
  Pixel closest{};
  double least_m = 1e9;
  for (int v = window.row_first; v <= window.row_last; ++v) {
    for (int u = window.column_first; u <= window.column_last; ++u) {
      if (!isInSheet({u, v})) continue;
      const double distance_m = norm(pointAt(u, v, static_cast<double>(at({u, v}))) - hip_m);
      if (distance_m >= least_m) continue;
      least_m = distance_m;
      closest = {u, v};
    }
  }
  return closest;
}

std::optional<FrameSurface::Cell> FrameSurface::cellAt(Pixel corner) const {
  Cell cell{corner, {}};
  for (int i = 0; i < 4; ++i) {
    const Pixel pixel{corner.column + i % 2, corner.row + i / 2};
    if (pixel.column >= rt::kFrameWidth || pixel.row >= rt::kFrameHeight || !isInSheet(pixel))
      return std::nullopt;
    cell.disparity[static_cast<std::size_t>(i)] = static_cast<double>(at(pixel));
  }
  return cell;
}

/// `s` along the row and `t` down the column, both from 0 to 1.
Vec3 FrameSurface::pointIn(const Cell& cell, double s, double t) const {
  const auto& d = cell.disparity;
  const double disparity = (1 - t) * ((1 - s) * d[0] + s * d[1]) + t * ((1 - s) * d[2] + s * d[3]);
  return pointAt(cell.corner.column + s, cell.corner.row + t, disparity);
}

/// The closest point of a lattice over the cell, then of finer and finer ones around the best.
Vec3 FrameSurface::closestIn(const Cell& cell, const Vec3& hip_m) const {
  double best_s = 0.5;
  double best_t = 0.5;
  Vec3 closest = pointIn(cell, best_s, best_t);
  double half = 0.5;
  for (int level = 0; level < kSearchLevels; ++level) {
    const double middle_s = best_s;
    const double middle_t = best_t;
    for (int place = 0; place < 25; ++place) {
      const double s = std::clamp(middle_s + half * (place % 5 - 2) / 2, 0.0, 1.0);
      const double t = std::clamp(middle_t + half * (place / 5 - 2) / 2, 0.0, 1.0);
      const Vec3 point = pointIn(cell, s, t);
      if (norm(point - hip_m) >= norm(closest - hip_m)) continue;
      closest = point;
      best_s = s;
      best_t = t;
    }
    half *= 0.4;
  }
  return closest;
}

std::optional<Vec3> FrameSurface::closestBehind(const Vec3& hip_m, double radius_m) {
  const std::optional<Pixel> start = pixelInFrontOf(hip_m);
  if (!start || depthAt(static_cast<double>(at(*start))) >= -hip_m.z) return std::nullopt;
  const int half_px = static_cast<int>(camera_.fx_px * radius_m / std::max(-hip_m.z - radius_m, 0.1));
  const Window window{
      std::max(start->column - half_px, 0), std::min(start->column + half_px, rt::kFrameWidth - 1),
      std::max(start->row - half_px, 0), std::min(start->row + half_px, rt::kFrameHeight - 1)};
  fillSheet(*start, window);
  const Pixel pixel = closestPixel(hip_m, window);
  Vec3 closest = pointAt(pixel.column, pixel.row, static_cast<double>(at(pixel)));
  for (int v = pixel.row - kSearchedAround_px; v < pixel.row + kSearchedAround_px; ++v) {
    for (int u = pixel.column - kSearchedAround_px; u < pixel.column + kSearchedAround_px; ++u) {
      const std::optional<Cell> cell = u >= 0 && v >= 0 ? cellAt({u, v}) : std::nullopt;
      if (!cell) continue;
      const Vec3 candidate = closestIn(*cell, hip_m);
      if (norm(candidate - hip_m) < norm(closest - hip_m)) closest = candidate;
    }
  }
  clearSheet(window);
  return closest;
}

}  // namespace hapticd::tools
