// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/depth_frame.h"
#include "rt/depth_model.h"
#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// The surface as one block of pixels sees it: a plane in disparity, which is a plane in space.
struct alignas(16) Facet {
  float disparity;   ///< at the block's middle, raw units; negative: nothing is known there
  float per_column;  ///< its change per pixel to the right, raw units
  float per_row;     ///< and per pixel downwards
  float per_second;  ///< and in time, by the motion of the surface
};

/// A surface that was last seen no farther than that beyond the camera's near limit, and vanished, came too
/// near.
inline constexpr double kNearLimitMargin_m = 0.05;

/// Square blocks of pixels, the lattice on which surfaces are estimated.
struct BlockLattice {
  static constexpr int kBlock_px = 4;
  static constexpr int kColumns = kFrameWidth / kBlock_px;
  static constexpr int kRows = kFrameHeight / kBlock_px;
  static constexpr std::size_t kBlocks = std::size_t{kColumns} * kRows;
  /// Of a block's middle pixel position from its first pixel.
  static constexpr double kMiddle_px = 0.5 * (kBlock_px - 1);
  static_assert(kColumns * kBlock_px == kFrameWidth && kRows * kBlock_px == kFrameHeight);

  static constexpr std::size_t at(int row, int column) noexcept {
    return static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column);
  }
};

/// Blocks, both ends inclusive; empty when a first is above its last.
struct BlockWindow {
  int column_first = 0;
  int column_last = -1;
  int row_first = 0;
  int row_last = -1;

  bool empty() const noexcept { return column_first > column_last || row_first > row_last; }
  int columns() const noexcept { return column_last - column_first + 1; }
  int rows() const noexcept { return row_last - row_first + 1; }
};

/// What lies between the middles of four neighbouring blocks.
enum class Cell : std::uint8_t {
  mixed,     ///< not all of it belongs to one surface: its pixels say what is where
  smooth,    ///< one surface that bends evenly
  least,     ///< a crease: of the four planes the one with the least disparity
  greatest,  ///< a crease: of the four planes the one with the greatest disparity
};

/// One of the surfaces that a depth image shows, block by block, and pixel by pixel where it ends.
struct SurfaceLayer {
  /// In the image: a pixel at its border that never has a measurement, as if it were outside.
  static constexpr std::uint16_t kBeyondView = kRawNoMeasurement + 1;

  std::uint16_t* image = nullptr;  ///< [kFramePixels] raw values, small gaps closed; kRawNoMeasurement: none
  Facet* facet = nullptr;          ///< [BlockLattice::kBlocks]
  Cell* cell = nullptr;  ///< [BlockLattice::kBlocks] to the right of and below the middle of each block
};

/// What the camera sees near the focus, and what it last saw behind that. A view; a SceneStorage owns the
/// memory. Immutable once published.
struct VisibleSurface {
  Vec3 centre_m_in_world;  ///< surfaces are known within `radius_m` of it, as far as the image shows them
  double radius_m = 0;     ///< 0: nothing is modelled
  BlockWindow blocks;      ///< whose facets are valid
  SurfaceLayer visible;
  SurfaceLayer hidden;  ///< the farthest surface known: what is visible where nothing is hidden behind it
  float of_facet_raw =
      3;  ///< a pixel belongs to a facet whose plane it lies on to within that many raw units
  bool hides_anything = false;  ///< `hidden` is modelled, and differs from `visible`

  /// True if places within `radius` of `p` may be looked at.  RT: safe.
  bool covers(const Vec3& p_m_in_world, double radius) const noexcept {
    return norm(p_m_in_world - centre_m_in_world) + radius <= radius_m;
  }
};
static_assert(std::is_trivially_copyable_v<VisibleSurface>);

/// A position in the image, pixels.
struct ImagePosition {
  double u;  ///< column
  double v;  ///< row
};

/// A surface where the ray of one image position meets it: a tangent plane.
struct Sheet {
  bool exists = false;
  bool beyond_view = false;        ///< nothing is there because the camera's view ends
  double inverse_depth_per_m = 0;  ///< 1/Z
  double distance_m = 0;           ///< from the camera to the tangent plane, > 0
  Vec3 normal_in_camera;           ///< unit vector towards the free side
  double speed_m_per_s = 0;        ///< of the surface along its normal

  double depth_m() const noexcept { return 1 / inverse_depth_per_m; }
};

/// Looks at a VisibleSurface at one time. Positions are in the camera's frame (x right, y up, looking along
/// -z), metres.  Thread: any.  RT: safe.
class SurfaceView {
 public:
  /// Surfaces more than `shell_m` in front of a place hide it, less half a raw unit at that depth: noise must
  /// not bring the front of a body that passes so near that the place would be inside of it.
  SurfaceView(const VisibleSurface& surface, const DepthModel& model, double shell_m, double age_s) noexcept
      : surface_(surface), model_(model.parameters()), shell_m_(shell_m), age_s_(age_s) {}

  static constexpr double kNearest_m = 0.05;

  static double depthOf(const Vec3& p) noexcept { return -p.z; }
  ImagePosition project(const Vec3& p) const noexcept {
    const double scale = 1 / depthOf(p);
    return {model_.cx_px + model_.fx_px * p.x * scale, model_.cy_px - model_.fy_px * p.y * scale};
  }
  static bool isInImage(const ImagePosition& image) noexcept {
    return image.u > -0.5 && image.u < kFrameWidth - 0.5 && image.v > -0.5 && image.v < kFrameHeight - 0.5;
  }
  /// The place at a depth on the ray of an image position.
  Vec3 placeAt(const ImagePosition& image, double depth_m) const noexcept {
    return {(image.u - model_.cx_px) / model_.fx_px * depth_m,
            (model_.cy_px - image.v) / model_.fy_px * depth_m, -depth_m};
  }
  /// The width of a pixel at a depth.
  double pitch_m(double depth_m) const noexcept { return depth_m / model_.fx_px; }
  /// What one raw unit is at a depth, metres.
  double rawUnit_m(double depth_m) const noexcept;
  double nearLimit_m() const noexcept { return model_.near_m; }

  /// What a place is.
  enum class Where : std::uint8_t {
    free,    ///< in front of the nearest known surface behind it, or nothing is known there
    inside,  ///< behind a surface by no more than the shell
    unseen,  ///< behind all that is known on its ray by more than the shell
    beyond,  ///< outside the image
  };
  struct Place {
    Where where = Where::free;
    Sheet sheet;            ///< the one that `distance_m` is from; may be none
    double distance_m = 0;  ///< from the sheet's plane, negative behind it; 0 without a sheet
  };
  Place look(const Vec3& p) const HAPTICD_RT;

  /// Of the surfaces at an image position the one that is nearest to a depth.
  Sheet sheetNear(const ImagePosition& image, double depth_m) const HAPTICD_RT;

  /// Distance of a place from a sheet's tangent plane, negative behind it.
  static double distanceFrom(const Sheet& sheet, const Vec3& p) noexcept {
    return sheet.distance_m + dot(sheet.normal_in_camera, p);
  }

 private:
  double shellAt(double depth_m) const noexcept;
  Sheet sheetOf(const SurfaceLayer& layer, const ImagePosition& image) const HAPTICD_RT;

  const VisibleSurface& surface_;
  const DepthModelParameters& model_;
  double shell_m_;
  double age_s_;
};

}  // namespace hapticd::rt
