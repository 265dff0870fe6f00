// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_image.h"
#include "rt/scene/focus_body.h"
#include "rt/scene/focus_corner.h"

namespace hapticd::rt {

/// The surface seen by one block of pixels: a plane in disparity, which is also a plane in space.
struct alignas(16) Facet {
  float disparity;   ///< at the middle of the block, raw units; negative: unknown
  float per_column;  ///< change per pixel to the right, raw units
  float per_row;     ///< change per pixel downwards, raw units
  float per_second;  ///< change per second due to motion of the surface, raw units
};

/// A surface last seen within this distance beyond the camera's near limit that then vanished has come too
/// near.
inline constexpr double kNearLimitMargin_m = 0.05;

/// Square blocks of pixels, the lattice on which surfaces are estimated. Pixels that do not fill a block at
/// the right or lower border belong to none.
struct BlockLattice {
  static constexpr int kBlock_px = 4;
  static constexpr int kMaxColumns = kMaxFrameWidth / kBlock_px;
  static constexpr int kMaxRows = kMaxFrameHeight / kBlock_px;
  /// Offset of the middle of a block from its first pixel.
  static constexpr double kMiddle_px = 0.5 * (kBlock_px - 1);

  int columns = 0;
  int rows = 0;

  BlockLattice() = default;
  explicit BlockLattice(const DepthModel& model) noexcept
      : columns(model.width_px() / kBlock_px), rows(model.height_px() / kBlock_px) {}

  std::size_t blocks() const noexcept { return at(rows, 0); }
  /// Returns the index of a block in arrays over the lattice.
  std::size_t at(int row, int column) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
};

/// A rectangle of blocks, all limits inclusive; empty when a first limit is above its last.
struct BlockWindow {
  int column_first = 0;
  int column_last = -1;
  int row_first = 0;
  int row_last = -1;

  bool empty() const noexcept { return column_first > column_last || row_first > row_last; }
  int columns() const noexcept { return column_last - column_first + 1; }
  int rows() const noexcept { return row_last - row_first + 1; }
};

/// Kind of surface between the middles of four adjacent blocks.
enum class Cell : std::uint8_t {
  mixed,     ///< more than one surface: the pixels decide
  smooth,    ///< one smooth surface
  least,     ///< a crease: the smallest disparity of the four planes
  greatest,  ///< a crease: the largest disparity of the four planes
};

/// One of the surfaces shown by a depth image, by blocks and, where it ends, by pixels.
struct SurfaceLayer {
  /// Value of a pixel at the image border that never has a measurement; treated as outside the image.
  static constexpr std::uint16_t kBeyondView = kNoRawDisparity + 1;

  /// Raw disparities with small gaps closed, in frame layout; kNoRawDisparity: none.
  std::uint16_t* image = nullptr;
  Facet* facet = nullptr;  ///< [BlockLattice::blocks()]
  /// [BlockLattice::blocks()] between the middle of each block and its right, lower and lower right
  /// neighbours.
  Cell* cell = nullptr;
};

/// The surface that the camera sees near the focus, and what it last saw behind it. A view; SceneStorage owns
/// the memory.
/// Thread: immutable once published.
struct VisibleSurface {
  Vec3 centre_m_in_world;  ///< surfaces are known within `radius_m` of it, as far as the image shows them
  double radius_m = 0;     ///< 0: nothing is modelled
  BlockLattice lattice;    ///< of the facets
  BlockWindow blocks;      ///< blocks with valid facets
  SurfaceLayer visible;
  SurfaceLayer hidden;  ///< the farthest known surface; equals `visible` where nothing is hidden
  /// A pixel belongs to a facet if it is within this many raw units of the facet's plane.
  float of_facet_raw = 3;
  bool hides_anything = false;  ///< `hidden` is modelled and differs from `visible`
  FocusBody body;               ///< the body seen at the focus; more exact than the facets, where it exists
  FocusCorner corner;           ///< where flat faces meet around the focus; more exact, where it has faces

  /// Returns true if places within `radius` of `p_m_in_world` may be looked up.  RT: safe.
  bool covers(const Vec3& p_m_in_world, double radius) const noexcept {
    return norm(p_m_in_world - centre_m_in_world) + radius <= radius_m;
  }
};
static_assert(std::is_trivially_copyable_v<VisibleSurface>);

/// A position in the image in pixels.
struct ImagePosition {
  double u;  ///< column
  double v;  ///< row
};

/// The tangent plane of a surface where it meets the ray of an image position.
struct Sheet {
  bool exists = false;
  bool beyond_view = false;        ///< there is none because the position is outside the camera's view
  double inverse_depth_per_m = 0;  ///< 1/Z
  double distance_m = 0;           ///< from the camera to the tangent plane, > 0
  Vec3 normal_in_camera;           ///< unit vector towards the free side
  double speed_m_per_s = 0;        ///< speed of the surface along its normal
  double extrapolated_per_m = 0;   ///< change of 1/Z since the frame that is assumed

  double depth_m() const noexcept { return 1 / inverse_depth_per_m; }
};

/// Evaluates a VisibleSurface at one point in time. Positions are in metres in the camera frame (x right, y
/// up, looking along -z).
/// Thread: any.  RT: safe.
class SurfaceView {
 public:
  /// Surfaces more than `shell_m` in front of a place hide it. Half a noise unit at that depth
  /// (DepthModel::noiseUnit_m) is subtracted, so that noise does not add the front of a passing body so close
  /// that the place would be inside it. `age_s`: time since the frame, over which moving facets are
  /// extrapolated.
  SurfaceView(const VisibleSurface& surface, const DepthModel& model, double shell_m, double age_s) noexcept
      : surface_(surface), model_(model), camera_(model.parameters()), shell_m_(shell_m), age_s_(age_s) {}

  /// From now on, a surface more than a shell behind what hides it is looked up in its place.
  void lookPast() noexcept { looks_past_ = true; }

  /// Smallest depth at which places are looked up.
  static constexpr double kNearest_m = 0.05;

  static double depthOf(const Vec3& p) noexcept { return -p.z; }
  /// Projects a place to its image position.
  ImagePosition project(const Vec3& p) const noexcept {
    const double scale = 1 / depthOf(p);
    return {camera_.cx_px + camera_.fx_px * p.x * scale, camera_.cy_px - camera_.fy_px * p.y * scale};
  }
  bool isInImage(const ImagePosition& image) const noexcept {
    return image.u > -0.5 && image.u < camera_.width_px - 0.5 && image.v > -0.5 &&
           image.v < camera_.height_px - 0.5;
  }
  /// Returns the place at a depth on the ray of an image position.
  Vec3 placeAt(const ImagePosition& image, double depth_m) const noexcept {
    return {(image.u - camera_.cx_px) / camera_.fx_px * depth_m,
            (camera_.cy_px - image.v) / camera_.fy_px * depth_m, -depth_m};
  }
  /// Returns the width of a pixel at a depth, in metres.
  double pitch_m(double depth_m) const noexcept { return depth_m / camera_.fx_px; }
  /// Returns the unit of tolerances at a depth, see DepthModel::noiseUnit_m().
  double noiseUnit_m(double depth_m) const noexcept { return model_.noiseUnit_m(depth_m); }
  double nearLimit_m() const noexcept { return camera_.near_m; }

  /// Where a place is relative to the known surfaces.
  enum class Where : std::uint8_t {
    free,    ///< in front of the nearest known surface on its ray, or nothing is known there
    inside,  ///< behind a surface by no more than the shell
    unseen,  ///< behind everything known on its ray by more than the shell
    beyond,  ///< outside the image
  };
  /// Result of sample().
  struct Place {
    Where where = Where::free;
    Sheet sheet;            ///< the surface that `distance_m` refers to; may not exist
    double distance_m = 0;  ///< from the tangent plane, negative behind it; 0 without a sheet
  };
  /// Classifies a place.
  Place sample(const Vec3& p) const HAPTICD_RT;

  /// Returns, of the surfaces at an image position, the one nearest to a depth.
  Sheet sheetNear(const ImagePosition& image, double depth_m) const HAPTICD_RT;

  /// Returns the surface of one layer at an image position.
  Sheet sheetOf(const SurfaceLayer& layer, const ImagePosition& image) const HAPTICD_RT;

  /// Returns the distance of a place from a sheet's tangent plane, negative behind it.
  static double distanceFrom(const Sheet& sheet, const Vec3& p) noexcept {
    return sheet.distance_m + dot(sheet.normal_in_camera, p);
  }

 private:
  double shellAt(double depth_m) const noexcept;
  bool looksPast(const Sheet& nearest, const Sheet& hidden) const noexcept;

  const VisibleSurface& surface_;
  const DepthModel& model_;
  const DepthModelParameters& camera_;
  double shell_m_;
  double age_s_;
  bool looks_past_ = false;
};

}  // namespace hapticd::rt
