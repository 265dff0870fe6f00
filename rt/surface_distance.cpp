// SPDX-License-Identifier: Apache-2.0
#include "rt/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace hapticd::rt {
namespace {

constexpr double kHalfBlock_px = 0.5 * BlockLattice::kBlock_px;
/// Patches and their interpolation differ by less, unless the interpolation belongs to another surface.
constexpr double kSameSurface_m = 0.002;
/// Nearer to the surface than this, the patch's normal is the direction.
constexpr double kOnSurface_m = 1e-6;
/// Larger windows are searched in steps of more than one block first.
constexpr int kMostBlocksAcross = 12;

/// Nothing is hidden in front of this block.
bool isSame(const Facet& a, const Facet& b) noexcept {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

}  // namespace

/// The nearest point found so far, in the camera's frame.
struct SurfaceDistance::Nearest {
  double squared_m2;
  Vec3 place;
  Vec3 normal;
  const SurfaceLayer* layer = nullptr;  ///< that it belongs to; null: none was found
  int row = -1;
  int column = -1;
  double speed_m_per_s = 0;
};

/// Compares each patch with the nearest one so far. A patch is the part of its plane that the block's pixels
/// see: the foot of the perpendicular is clamped to them in the image.
void SurfaceDistance::searchLayer(const SurfaceLayer& layer, const Vec3& p, const BlockWindow& whole,
                                  Nearest& nearest) const HAPTICD_RT {
  const DepthModelParameters& model = model_.parameters();
  if (whole.empty()) return;
  const double a = model.a_per_m;
  // Here y points down and z forward, as in the image.
  const Vec3 at{p.x, -p.y, -p.z};
  const ImagePosition image = view_.project(p);
  // A ray at an angle of n pixels from that of `p` passes at least this far from it, per pixel: the depth
  // over the focal length times the cosine of the angle to the optical axis.
  constexpr double kLeastCosine = 0.8;
  const double per_pixel_m = kLeastCosine * view_.pitch_m(SurfaceView::depthOf(p));
  const auto compare = [&](int row, int column) noexcept {
    const double first_column = column * BlockLattice::kBlock_px - 0.5;
    const double first_row = row * BlockLattice::kBlock_px - 0.5;
    const double beside_px =
        std::max({0.0, first_column - image.u, image.u - first_column - BlockLattice::kBlock_px});
    const double above_px =
        std::max({0.0, first_row - image.v, image.v - first_row - BlockLattice::kBlock_px});
    if ((beside_px * beside_px + above_px * above_px) * per_pixel_m * per_pixel_m >= nearest.squared_m2)
      return;
    const Facet& facet = layer.facet[surface_.lattice.at(row, column)];
    if (facet.disparity < 0) return;
    if (&layer == &surface_.hidden && isSame(facet, surface_.visible.facet[surface_.lattice.at(row, column)]))
      return;
    const double u = column * BlockLattice::kBlock_px + BlockLattice::kMiddle_px - model.cx_px;
    const double v = row * BlockLattice::kBlock_px + BlockLattice::kMiddle_px - model.cy_px;
    const double w = a * (double{facet.disparity} + age_s_ * double{facet.per_second}) + model.b_per_m;
    if (!(w > 0)) return;
    const double w_u = a * double{facet.per_column};
    const double w_v = a * double{facet.per_row};
    // the plane N * X = 1, see SurfaceView
    const Vec3 plane{w_u * model.fx_px, w_v * model.fy_px, w - w_u * u - w_v * v};
    const double inverse_squared = 1 / dot(plane, plane);
    const double off = 1 - dot(plane, at);
    if (off * off * inverse_squared >= nearest.squared_m2) return;
    const Vec3 foot = at + off * inverse_squared * plane;
    Vec3 place = foot;
    const double foot_u = model.fx_px * foot.x - u * foot.z;
    const double foot_v = model.fy_px * foot.y - v * foot.z;
    const double half = kHalfBlock_px * foot.z;
    if (!(std::abs(foot_u) <= half && std::abs(foot_v) <= half)) {
      const double du = std::clamp(foot.z > 0 ? foot_u / foot.z : 0.0, -kHalfBlock_px, kHalfBlock_px);
      const double dv = std::clamp(foot.z > 0 ? foot_v / foot.z : 0.0, -kHalfBlock_px, kHalfBlock_px);
      const double depth = 1 / (w + w_u * du + w_v * dv);
      if (!(depth > 0)) return;
      place = {(u + du) / model.fx_px * depth, (v + dv) / model.fy_px * depth, depth};
    }
    const Vec3 to = at - place;
    const double squared = dot(to, to);
    if (squared >= nearest.squared_m2) return;
    const double length = std::sqrt(inverse_squared);
    nearest = {squared,
               {place.x, -place.y, -place.z},
               {-length * plane.x, length * plane.y, length * plane.z},
               &layer,
               row,
               column};
  };
  const int row_before = nearest.row;
  const int column_before = nearest.column;
  // The block in front of the place first: it usually leaves few others to compare.
  constexpr double kPerBlock = 1.0 / BlockLattice::kBlock_px;
  compare(std::clamp(static_cast<int>(image.v * kPerBlock), whole.row_first, whole.row_last),
          std::clamp(static_cast<int>(image.u * kPerBlock), whole.column_first, whole.column_last));
  // Blocks beyond this cannot be nearer, see per_pixel_m; compare() decides the same for each.
  const double reach_px = std::sqrt(nearest.squared_m2) / per_pixel_m + 1;
  const auto blockAt = [](double pixel) { return static_cast<int>(std::floor(pixel * kPerBlock)); };
  const BlockWindow window{std::max(whole.column_first, blockAt(image.u - reach_px)),
                           std::min(whole.column_last, blockAt(image.u + reach_px)),
                           std::max(whole.row_first, blockAt(image.v - reach_px)),
                           std::min(whole.row_last, blockAt(image.v + reach_px))};
  const int across = std::max(window.columns(), window.rows());
  const int stride = (across + kMostBlocksAcross - 1) / kMostBlocksAcross;
  for (int row = window.row_first; row <= window.row_last; row += stride) {
    for (int column = window.column_first; column <= window.column_last; column += stride)
      compare(row, column);
  }
  if (stride == 1 || (nearest.row == row_before && nearest.column == column_before)) return;
  const int middle_row = nearest.row;
  const int middle_column = nearest.column;
  for (int row = std::max(window.row_first, middle_row - stride);
       row <= std::min(window.row_last, middle_row + stride); ++row) {
    for (int column = std::max(window.column_first, middle_column - stride);
         column <= std::min(window.column_last, middle_column + stride); ++column)
      compare(row, column);
  }
}

/// Passes from the patch to the interpolated surface, by steps of Newton's method for the foot of the
/// perpendicular. Beside an outline, where the interpolation belongs to another body, the patch stays.
void SurfaceDistance::refine(const Vec3& p, Nearest& nearest) const HAPTICD_RT {
  Vec3 foot = nearest.place;
  double distance = 0;
  double speed = 0;
  Vec3 normal;
  constexpr int kSteps = 2;
  for (int step = 0; step < kSteps; ++step) {
    const double depth = SurfaceView::depthOf(foot);
    if (!(depth > SurfaceView::kNearest_m)) return;
    const ImagePosition image = view_.project(foot);
    if (!view_.isInImage(image)) return;
    const Sheet sheet = view_.sheetOf(*nearest.layer, image);
    if (!sheet.exists || std::abs(sheet.depth_m() - depth) > kSameSurface_m) return;
    distance = SurfaceView::distanceFrom(sheet, p);
    normal = sheet.normal_in_camera;
    speed = sheet.speed_m_per_s;
    foot = p - distance * normal;
  }
  const double patch_m = std::sqrt(nearest.squared_m2);
  if (std::abs(distance - patch_m) > kSameSurface_m || !(distance > 0)) return;
  nearest.squared_m2 = distance * distance;
  nearest.place = foot;
  nearest.normal = normal;
  nearest.speed_m_per_s = speed;
}

SurfaceDistance::Result SurfaceDistance::at(const Vec3& p_m_in_world, double most_m) const HAPTICD_RT {
  Result result;
  result.modelled = surface_.covers(p_m_in_world, 0);
  if (!result.modelled) return result;
  const Vec3 p = model_.positionInCamera(p_m_in_world);
  const double depth = SurfaceView::depthOf(p);
  if (!(depth > SurfaceView::kNearest_m)) return result;
  const SurfaceView::Place here = view_.look(p);
  if (here.where == SurfaceView::Where::inside) {
    result.signed_distance = {here.distance_m, model_.directionInWorld(here.sheet.normal_in_camera)};
    result.speed_m_per_s = here.sheet.speed_m_per_s;
    return result;
  }
  const double nearest_depth = std::max(SurfaceView::kNearest_m, depth - most_m);
  const double reach_px = most_m / view_.pitch_m(nearest_depth) + 1;
  const ImagePosition image = view_.project(p);
  const auto block = [](double pixel) {
    return static_cast<int>(std::floor(pixel * (1.0 / BlockLattice::kBlock_px)));
  };
  constexpr double kFar_px = 1e6;
  const double u = std::clamp(image.u, -kFar_px, kFar_px);
  const double v = std::clamp(image.v, -kFar_px, kFar_px);
  const BlockWindow window{std::max(surface_.blocks.column_first, block(u - reach_px)),
                           std::min(surface_.blocks.column_last, block(u + reach_px)),
                           std::max(surface_.blocks.row_first, block(v - reach_px)),
                           std::min(surface_.blocks.row_last, block(v + reach_px))};
  Nearest nearest{most_m * most_m, {}, {}};
  searchLayer(surface_.visible, p, window, nearest);
  if (surface_.hides_anything) searchLayer(surface_.hidden, p, window, nearest);
  if (nearest.layer == nullptr) return result;
  refine(p, nearest);
  const double distance = std::sqrt(nearest.squared_m2);
  const Vec3 normal = distance > kOnSurface_m ? (1 / distance) * (p - nearest.place) : nearest.normal;
  result.signed_distance = {distance, model_.directionInWorld(normal)};
  result.speed_m_per_s = nearest.speed_m_per_s;
  return result;
}

}  // namespace hapticd::rt
