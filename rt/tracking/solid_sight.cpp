// SPDX-License-Identifier: Apache-2.0
#include "rt/tracking/solid_sight.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rt/tracking/part_cube.h"

namespace hapticd::rt {
namespace {

/// Where a ray meets the solid.
struct Entry {
  bool met = false;
  Vec3 place_m{};      // in the solid's frame
  double depth_m = 0;  // along the optical axis
  double cosine = 0;   // between normal and sight
};

/// Traces the ray eye + z * ray to the solid's surface; both in the solid's frame. z is the depth.
Entry traced(const DistanceGrid& grid, const SolidBall& ball, const Vec3& eye_m, const Vec3& ray) noexcept {
  constexpr int kMaxSteps = 40;
  constexpr double kHit_m = 2e-4;
  const double length = norm(ray);
  const Vec3 direction = (1 / length) * ray;
  const Vec3 to_centre = ball.centre_m - eye_m;
  const double middle_m = dot(to_centre, direction);
  const double beside2 = dot(to_centre, to_centre) - middle_m * middle_m;
  const double half2 = ball.radius_m * ball.radius_m - beside2;
  if (!(half2 > 0)) return {};
  const double half_m = std::sqrt(half2);
  double along_m = std::max(0.0, middle_m - half_m);
  for (int step = 0; step < kMaxSteps && along_m < middle_m + half_m; ++step) {
    const GridDistance found = distanceAt(grid, eye_m + along_m * direction);
    if (found.distance_m < kHit_m) {
      const double slope = norm(found.gradient);
      return {slope > 0, eye_m + along_m * direction, along_m / length,
              slope > 0 ? -dot(found.gradient, direction) / slope : 0};
    }
    along_m += std::max(found.distance_m, kHit_m);
  }
  return {};
}

/// The ray of a pixel in the world, of depth 1 m.
Vec3 rayOf(const DepthModel& model, int column, int row) noexcept {
  const DepthModel::Ray& c = model.columnRays()[column];
  const DepthModel::Ray& r = model.rowRays()[row];
  return {c.x + r.x, c.y + r.y, c.z + r.z};
}

std::uint16_t rawAt(const DepthModel& model, std::span<const std::uint16_t> image, int column,
                    int row) noexcept {
  return image[static_cast<std::size_t>(row) * static_cast<std::size_t>(model.stride_px()) +
               static_cast<std::size_t>(column)];
}

/// Pixels by the part of the surface that they show.
class PartCounts {
 public:
  explicit PartCounts(const SolidBall& ball) noexcept : parts_(ball.centre_m, ball.radius_m / 2) {}

  void add(const Vec3& place_m_in_solid, bool matches) noexcept {
    Part& part = parts_.at(place_m_in_solid);
    ++part.visible;
    part.matching += matches ? 1 : 0;
  }
  /// 1 without any part of enough pixels.
  double leastShare() const noexcept {
    constexpr int kEnough = 8;
    double least = 1;
    for (const Part& part : parts_.all()) {
      if (part.visible >= kEnough) least = std::min(least, static_cast<double>(part.matching) / part.visible);
    }
    return least;
  }

 private:
  struct Part {
    int visible = 0;
    int matching = 0;
  };
  PartCube<Part, 6> parts_;
};

bool fits(const DepthModel& model, std::span<const std::uint16_t> image) noexcept {
  return image.size() >= model.pixels();
}

static_assert(PixelLattice::kMaxPixels <= static_cast<int>(kMaxPatches));

}  // namespace

SolidBall ballAround(const DistanceGrid& grid) noexcept {
  if (grid.coefficients == nullptr) return {};
  // A coefficient is about the distance of its sample.
  Vec3 lowest{grid.samples[0] * 1.0, grid.samples[1] * 1.0, grid.samples[2] * 1.0};
  Vec3 highest{-1, -1, -1};
  const std::int16_t* coefficient = grid.coefficients;
  for (std::uint32_t z = 0; z < grid.samples[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.samples[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.samples[0]; ++x) {
        if (*coefficient++ > 0) continue;
        lowest = {std::min(lowest.x, x * 1.0), std::min(lowest.y, y * 1.0), std::min(lowest.z, z * 1.0)};
        highest = {std::max(highest.x, x * 1.0), std::max(highest.y, y * 1.0), std::max(highest.z, z * 1.0)};
      }
    }
  }
  if (highest.x < 0) return {};
  const Vec3 middle = 0.5 * (lowest + highest);
  coefficient = grid.coefficients;
  double square = 0;
  for (std::uint32_t z = 0; z < grid.samples[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.samples[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.samples[0]; ++x) {
        if (*coefficient++ > 0) continue;
        const Vec3 off = Vec3{x * 1.0, y * 1.0, z * 1.0} - middle;
        square = std::max(square, dot(off, off));
      }
    }
  }
  // The boundary is at most the diagonal of a cell beyond the last sample inside.
  return {grid.origin_m + grid.spacing_m * middle, grid.spacing_m * (std::sqrt(square) + std::sqrt(3.0))};
}

bool SightMask::covers(const Vec3& place_m_in_world) const noexcept {
  const Vec3 along = to_m_in_world - from_m_in_world;
  const Vec3 off = place_m_in_world - from_m_in_world;
  const double square = dot(along, along);
  const double share = square > 0 ? std::clamp(dot(off, along) / square, 0.0, 1.0) : 0;
  return norm(off - share * along) < radius_m;
}

PixelLattice latticeOver(const DepthModel& model, const Vec3& centre_m_in_world, double radius_m,
                         int max_pixels) noexcept {
  const PixelWindow window = model.pixelsOfBall(centre_m_in_world, radius_m);
  if (window.empty()) return {};
  const int columns = window.column_last - window.column_first + 1;
  const int rows = window.row_last - window.row_first + 1;
  const int most = std::clamp(max_pixels, 1, PixelLattice::kMaxPixels);
  PixelLattice lattice{.column_first = window.column_first, .row_first = window.row_first};
  // From the step that a square would need on; at the borders a lattice has up to one more row and column.
  lattice.step_px = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(columns) * rows / most)));
  for (;; ++lattice.step_px) {
    lattice.columns = (columns - 1) / lattice.step_px + 1;
    lattice.rows = (rows - 1) / lattice.step_px + 1;
    if (lattice.pixels() <= most) return lattice;
  }
}

std::size_t gatherPoints(const DepthModel& model, std::span<const std::uint16_t> image,
                         const PixelLattice& lattice, const DistanceGrid& grid, const SolidPose& pose,
                         double range_m, const std::optional<SightMask>& mask,
                         std::span<TrackingPoint> points) noexcept {
  if (!fits(model, image)) return 0;
  std::size_t count = 0;
  // Pixels of the lattice per patch; a fraction where the patches are no multiple of the step.
  const double per_patch = std::max(1.0, model.parameters().noise.correlation_px / lattice.step_px);
  const auto patchOf = [per_patch](int index) { return static_cast<int>(index / per_patch); };
  const int patches_per_row = patchOf(lattice.columns - 1) + 1;
  for (int j = 0; j < lattice.rows; ++j) {
    const int row = lattice.row_first + j * lattice.step_px;
    for (int i = 0; i < lattice.columns; ++i) {
      const int column = lattice.column_first + i * lattice.step_px;
      const double depth_m = model.depth_m(rawAt(model, image, column, row));
      if (!(depth_m > 0)) continue;
      const Vec3 place_m = depth_m * rayOf(model, column, row) + model.cameraPosition_m_in_world();
      if (mask && mask->covers(place_m)) continue;
      if (!(std::abs(distanceAt(grid, pose.placeIn(place_m)).distance_m) < range_m)) continue;
      if (count == points.size()) return count;
      points[count++] = {.place_m = place_m,
                         .depth_sigma_m = kKinectNoise_raw * model.noiseUnit_m(depth_m),
                         .patch = static_cast<std::uint16_t>(patchOf(j) * patches_per_row + patchOf(i))};
    }
  }
  return count;
}

SightCount countSight(const DepthModel& model, std::span<const std::uint16_t> image,
                      const PixelLattice& lattice, const DistanceGrid& grid, const SolidBall& ball,
                      const SolidPose& pose, double gate_m, double front_m,
                      const std::optional<SightMask>& mask) noexcept {
  SightCount count;
  if (!fits(model, image)) return count;
  PartCounts parts(ball);
  const Vec3 eye_m_in_solid = pose.placeIn(model.cameraPosition_m_in_world());
  for (int j = 0; j < lattice.rows; ++j) {
    const int row = lattice.row_first + j * lattice.step_px;
    for (int i = 0; i < lattice.columns; ++i) {
      const int column = lattice.column_first + i * lattice.step_px;
      const Vec3 ray = rayOf(model, column, row);
      const Entry entry = traced(grid, ball, eye_m_in_solid, pose.directionIn(ray));
      if (!entry.met || !(entry.cosine > kMinSightCosine)) continue;
      ++count.expected;
      const double depth_m = model.depth_m(rawAt(model, image, column, row));
      if (!(depth_m > 0)) {
        ++count.unmeasured;
        continue;
      }
      const Vec3 place_m = depth_m * ray + model.cameraPosition_m_in_world();
      const double distance_m = distanceAt(grid, pose.placeIn(place_m)).distance_m;
      if (mask && mask->covers(place_m)) {
        ++count.hidden;
      } else if (std::abs(distance_m) < gate_m) {
        ++count.matching;
        parts.add(entry.place_m, true);
      } else if (depth_m < entry.depth_m && distance_m > front_m) {
        ++count.hidden;
      } else {
        ++count.missing;
        parts.add(entry.place_m, false);
      }
    }
  }
  count.least_share_of_part = parts.leastShare();
  return count;
}

}  // namespace hapticd::rt
