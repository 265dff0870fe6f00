// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "rt/base/vec3.h"
#include "rt/depth/depth_model.h"
#include "rt/fixtures/distance_grid.h"
#include "rt/tracking/pose_fit.h"
#include "rt/tracking/solid_pose.h"

/// A solid as a depth camera sees it: which pixels can show it, the points that they measure, and how many of
/// those that should show it do.
namespace hapticd::rt {

/// A ball around a solid, in the solid's frame.
struct SolidBall {
  Vec3 centre_m{};
  double radius_m = 0;  ///< 0: the grid holds no solid
};

/// Returns a ball that contains the solid of a grid.  RT: not safe (reads the whole grid).
SolidBall ballAround(const DistanceGrid& grid) noexcept;

/// A place near which measured points do not count, because a hand or a tool is there: the capsule around the
/// segment between two places. In the world.
struct SightMask {
  Vec3 from_m_in_world{};
  Vec3 to_m_in_world{};
  double radius_m = 0;

  bool covers(const Vec3& place_m_in_world) const noexcept;
};

/// Regularly spaced pixels of an image.
struct PixelLattice {
  static constexpr int kMaxPixels = 4096;

  int column_first = 0;
  int row_first = 0;
  int columns = 0;  ///< of the lattice; 0: no pixel
  int rows = 0;
  int step_px = 1;

  int pixels() const noexcept { return columns * rows; }
};

/// Returns the finest lattice of at most `max_pixels`, 1..PixelLattice::kMaxPixels, over the pixels that can
/// see a ball in the world. Empty where the camera does not see it.  RT: safe.
PixelLattice latticeOver(const DepthModel& model, const Vec3& centre_m_in_world, double radius_m,
                         int max_pixels) noexcept;

/// Writes the measured points of a lattice that are within `range_m` of the solid at this pose and not
/// masked, in the world, and returns their number; no more than `points` has room for. `image`: raw values of
/// a frame of the model's camera. Effort: one look-up of the grid for each pixel of the lattice.  RT: safe.
std::size_t gatherPoints(const DepthModel& model, std::span<const std::uint16_t> image,
                         const PixelLattice& lattice, const DistanceGrid& grid, const SolidPose& pose,
                         double range_m, const std::optional<SightMask>& mask,
                         std::span<TrackingPoint> points) noexcept;

/// What the pixels show that should show the solid.
struct SightCount {
  std::size_t expected = 0;    ///< pixels whose rays meet the solid, not at a grazing angle
  std::size_t matching = 0;    ///< of these, measure a point of the solid's surface
  std::size_t missing = 0;     ///< measure a point behind it, or one so little in front that it hides nothing
  std::size_t hidden = 0;      ///< measure something that hides the solid, or are masked
  std::size_t unmeasured = 0;  ///< measure nothing
  /// share() of the part of the surface where it is lowest, parts being cubes of half the solid's radius: a
  /// face that is seen at a grazing angle has few pixels, but without it the solid can slide.
  double least_share_of_part = 0;

  /// Of the pixels that could contradict the pose, the share of those that agree with it.
  double share() const noexcept {
    const std::size_t visible = matching + missing;
    return visible == 0 ? 0 : static_cast<double>(matching) / static_cast<double>(visible);
  }
  double visibleShare() const noexcept {
    return expected == 0 ? 0 : static_cast<double>(matching + missing) / static_cast<double>(expected);
  }
};

/// Counts these pixels over a lattice, by tracing their rays to the solid's surface. A point counts as of the
/// surface if it is within `gate_m` of it, and as hiding the solid if it is more than `front_m` in front of
/// it. Effort: at most 40 look-ups of the grid for each pixel of the lattice.  RT: safe.
SightCount countSight(const DepthModel& model, std::span<const std::uint16_t> image,
                      const PixelLattice& lattice, const DistanceGrid& grid, const SolidBall& ball,
                      const SolidPose& pose, double gate_m, double front_m,
                      const std::optional<SightMask>& mask) noexcept;

}  // namespace hapticd::rt
