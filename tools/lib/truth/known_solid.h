// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/camera/synthetic/scene_camera.h"
#include "rt/base/vec3.h"
#include "rt/fixtures/distance_grid.h"
#include "rt/tracking/solid_pose.h"

/// Solids of the size of an organ whose surface is known exactly, to be tracked by a depth camera: as
/// distance grids, and as what a camera sees of them at any pose.
namespace hapticd::tools {

/// The first four show themselves, more or less; the others can slide or turn without being seen to.
enum class SolidKind : std::uint8_t {
  organ,            ///< an ellipsoid of 50, 40 and 30 mm with bumps of several sizes, none like another
  ellipsoid,        ///< half axes 50, 40 and 30 mm
  round_ellipsoid,  ///< half axes 50, 45 and 40 mm
  corner,           ///< a cube of 80 mm whose corner points to the camera
  sphere,           ///< radius 50 mm
  cylinder,         ///< radius 25 mm, 120 mm along x
  plate,            ///< 120 x 100 x 15 mm, its face to the camera
};
inline constexpr std::array kAllSolids{SolidKind::organ,  SolidKind::ellipsoid, SolidKind::round_ellipsoid,
                                       SolidKind::corner, SolidKind::sphere,    SolidKind::cylinder,
                                       SolidKind::plate};
std::string_view nameOf(SolidKind kind);

/// Metres to the solid's surface, negative inside; exact at the surface and outside of it except for the
/// organ, where it is a lower bound. The solid is around the origin, and at the identity its side of interest
/// is towards +z.  Thread: any.
double distanceFrom(SolidKind kind, const rt::Vec3& place_m);

/// Radius of a ball around the origin that holds the solid.
double radiusOf(SolidKind kind);

/// The solid's distance on a grid, with its memory.
class SolidGrid {
 public:
  SolidGrid(SolidKind kind, double spacing_m);
  SolidGrid(const SolidGrid&) = delete;
  SolidGrid& operator=(const SolidGrid&) = delete;

  const rt::DistanceGrid& grid() const noexcept { return grid_; }

 private:
  rt::DistanceGrid grid_;
  std::vector<std::int16_t> coefficients_;
};

/// A solid at a place in front of a camera at the world's origin that looks along -z.
struct PlacedSolid {
  SolidKind kind = SolidKind::organ;
  rt::SolidPose T_world_solid;
};

/// Depth along the optical axis of the first surface on the ray (x, y, -1) from the origin; infinite where it
/// meets none. Beyond all solids is a wall at `wall_m`, which may be infinite.  Thread: any.
double depthOf(const std::vector<PlacedSolid>& solids, double wall_m, const rt::Vec3& ray);

void measure(const std::vector<PlacedSolid>& solids, double wall_m, drivers::SceneCamera& camera);

}  // namespace hapticd::tools
