// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/mesh_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hapticd::solids {
namespace {

using rt::Vec3;

constexpr double kInside = 0.5;  // winding numbers above this are inside
/// On the surface itself the winding number is about 1/2 of any mesh, and the sign does not matter.
constexpr double kOnSurface_m = 1e-7;
constexpr double kUnclearFrom = 0.2, kUnclearTo = 0.8;

/// Samples in blocks, so that those far from the surface cost one query for all of them.
class MeshSampling {
 public:
  MeshSampling(const MeshBody& body, double band_m, SampledField& grid)
      : body_(body),
        tree_(body.surface()),
        band_m_(band_m),
        grid_(grid),
        nearest_(grid.count(), TriangleTree::kNone),
        is_far_(grid.count(), 0) {}

  WindingRange run(FarSamples far_samples) {
    for (int z = 0; z < grid_.samples[2]; z += kBlock)
      for (int y = 0; y < grid_.samples[1]; y += kBlock)
        for (int x = 0; x < grid_.samples[0]; x += kBlock) sampleBlock({x, y, z});
    const unsigned orders = far_samples == FarSamples::nearly_exact ? 8 : 0;
    for (unsigned directions = 0; directions < orders; ++directions) spread(directions);
    return winding_;
  }

 private:
  static constexpr int kBlock = 4;

  /// The nearest triangle, found quickly where the one before is near.
  NearestTriangle nearestTo(const Vec3& place_m) {
    NearestTriangle guess;
    if (last_ != TriangleTree::kNone) guess = {last_, tree_.squaredDistance(place_m, last_)};
    const NearestTriangle found = tree_.nearest(place_m, guess);
    last_ = found.triangle;
    return found;
  }

  void sampleBlock(const std::array<int, 3>& first) {
    std::array<int, 3> end{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      end[axis] = std::min(first[axis] + kBlock, grid_.samples[axis]);
    const Vec3 low_m = grid_.placeOf(first[0], first[1], first[2]);
    const Vec3 high_m = grid_.placeOf(end[0] - 1, end[1] - 1, end[2] - 1);
    const Vec3 centre_m = 0.5 * (low_m + high_m);
    const double radius_m = 0.5 * norm(high_m - low_m);
    const NearestTriangle of_centre = nearestTo(centre_m);
    const bool is_far = std::sqrt(of_centre.squared_m2) > band_m_ + radius_m;
    if (is_far) return fillFarBlock(first, end, of_centre.triangle, body_.winding(centre_m) > kInside);
    // each sample has a neighbour that was visited before: in its row, or the begin of the row or layer
    // before
    Signed layer, row, last;
    for (int z = first[2]; z < end[2]; ++z)
      for (int y = first[1]; y < end[1]; ++y)
        for (int x = first[0]; x < end[0]; ++x) {
          const Signed& before = x > first[0] ? last : y > first[1] ? row : layer;
          last = sample(x, y, z, before, centre_m, of_centre);
          if (x == first[0]) row = last;
          if (x == first[0] && y == first[1]) layer = last;
        }
  }

  /// Distance of a sample, and on which side it is; the default: of none.
  struct Signed {
    double distance_m = 0;
    bool is_inside = false;
  };

  /// `before`: a sample one spacing away. `centre`: of the block, and its nearest triangle.
  Signed sample(int x, int y, int z, const Signed& before, const Vec3& centre_m,
                const NearestTriangle& of_centre) {
    const Vec3 place_m = grid_.placeOf(x, y, z);
    const std::size_t index = grid_.indexOf(x, y, z);
    const bool is_far = std::sqrt(of_centre.squared_m2) - norm(place_m - centre_m) > band_m_;
    is_far_[index] = is_far ? 1 : 0;
    nearest_[index] = is_far ? of_centre.triangle : nearestTo(place_m).triangle;
    const double distance_m = std::sqrt(tree_.squaredDistance(place_m, nearest_[index]));
    // a surface between two samples is not farther from both than they are from each other
    const bool same_side =
        before.distance_m + distance_m > (1 + 1e-9) * grid_.spacing_m && before.distance_m > 0;
    const bool is_known =
        same_side && (body_.isClosed() || std::min(before.distance_m, distance_m) > band_m_);
    const bool is_inside =
        is_known ? before.is_inside : isInside(place_m, distance_m <= band_m_ && distance_m > kOnSurface_m);
    grid_.distance_m[index] = static_cast<float>(is_inside ? -distance_m : distance_m);
    return {distance_m, is_inside};
  }

  /// No surface passes through a block that is far away, so it lies on one side.
  void fillFarBlock(const std::array<int, 3>& first, const std::array<int, 3>& end, std::uint32_t triangle,
                    bool is_inside) {
    for (int z = first[2]; z < end[2]; ++z)
      for (int y = first[1]; y < end[1]; ++y)
        for (int x = first[0]; x < end[0]; ++x) {
          const std::size_t index = grid_.indexOf(x, y, z);
          const double distance_m = std::sqrt(tree_.squaredDistance(grid_.placeOf(x, y, z), triangle));
          is_far_[index] = 1;
          nearest_[index] = triangle;
          grid_.distance_m[index] = static_cast<float>(is_inside ? -distance_m : distance_m);
        }
  }

  bool isInside(const Vec3& place_m, bool counts) {
    const double number = body_.winding(place_m);
    if (!counts) return number > kInside;
    ++winding_.samples;
    winding_.lowest = std::min(winding_.lowest, number);
    winding_.highest = std::max(winding_.highest, number);
    if (number >= kUnclearFrom && number <= kUnclearTo) ++winding_.unclear;
    if (std::abs(number - kInside) < winding_.unclearest) {
      winding_.unclearest = std::abs(number - kInside);
      winding_.unclearest_m = place_m;
    }
    return number > kInside;
  }

  /// Offers the triangles of the neighbours to each far sample, in one of eight orders.
  void spread(unsigned directions) {
    std::array<int, 3> step{}, begin{}, end{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool is_forward = (directions >> axis & 1U) == 0;
      step[axis] = is_forward ? 1 : -1;
      begin[axis] = is_forward ? 0 : grid_.samples[axis] - 1;
      end[axis] = is_forward ? grid_.samples[axis] : -1;
    }
    for (int z = begin[2]; z != end[2]; z += step[2])
      for (int y = begin[1]; y != end[1]; y += step[1])
        for (int x = begin[0]; x != end[0]; x += step[0]) {
          const std::size_t index = grid_.indexOf(x, y, z);
          if (is_far_[index] == 0) continue;
          if (x != begin[0]) offer(index, grid_.indexOf(x - step[0], y, z), x, y, z);
          if (y != begin[1]) offer(index, grid_.indexOf(x, y - step[1], z), x, y, z);
          if (z != begin[2]) offer(index, grid_.indexOf(x, y, z - step[2]), x, y, z);
        }
  }

  void offer(std::size_t index, std::size_t neighbour, int x, int y, int z) {
    const std::uint32_t triangle = nearest_[neighbour];
    if (triangle == nearest_[index]) return;
    const auto distance_m =
        static_cast<float>(std::sqrt(tree_.squaredDistance(grid_.placeOf(x, y, z), triangle)));
    if (distance_m >= std::abs(grid_.distance_m[index])) return;
    nearest_[index] = triangle;
    grid_.distance_m[index] = std::copysign(distance_m, grid_.distance_m[index]);
  }

  const MeshBody& body_;
  const TriangleTree& tree_;
  double band_m_;
  SampledField& grid_;
  std::vector<std::uint32_t> nearest_;  ///< of each sample
  std::vector<std::uint8_t> is_far_;
  std::uint32_t last_ = TriangleTree::kNone;
  WindingRange winding_;
};

}  // namespace

WindingRange sampleMesh(const MeshBody& body, double band_m, SampledField& grid, FarSamples far_samples) {
  return MeshSampling(body, band_m, grid).run(far_samples);
}

}  // namespace hapticd::solids
