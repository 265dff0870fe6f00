// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/mesh_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

namespace hapticd::solids {
namespace {

using rt::Vec3;

constexpr double kInside = 0.5;  // winding numbers above this are inside
constexpr double kHidden = 1.0;  // between that of the surface, 1/2, and of a face inside, 3/2
constexpr double kUnclearFrom = 0.2, kUnclearTo = 0.8;

std::array<Vec3, 3> cornersOf(const TriangleMesh& mesh, const Triangle& t) {
  return {mesh.points_m[t[0]], mesh.points_m[t[1]], mesh.points_m[t[2]]};
}

/// An edge as one of its faces runs through it.
struct DirectedEdge {
  std::uint32_t low, high, face;
  bool is_forward;  ///< from low to high
  auto operator<=>(const DirectedEdge&) const = default;
};

/// Calls visit with the edges between the same points, for each pair of points.
template <typename Visit>
void forEachEdge(const TriangleMesh& mesh, Visit visit) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::uint32_t face = 0; face < mesh.triangles.size(); ++face)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = mesh.triangles[face][i], to = mesh.triangles[face][(i + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), face, from < to});
    }
  std::ranges::sort(edges);
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin;
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
      ++end;
    visit(std::span<const DirectedEdge>(edges).subspan(begin, end - begin));
    begin = end;
  }
}

bool isClosedMesh(const TriangleMesh& mesh) {
  bool is_closed = true;
  forEachEdge(mesh, [&](std::span<const DirectedEdge> same) {
    const auto forward = static_cast<std::size_t>(std::ranges::count(same, true, &DirectedEdge::is_forward));
    is_closed = is_closed && 2 * forward == same.size();
  });
  return is_closed;
}

/// The faces of each part: those that edges of two faces connect. Within a part all agree about the outside
/// as `is_turned` says, unless the surface has one side only.
struct Parts {
  std::vector<std::vector<std::uint32_t>> faces;
  std::vector<bool> is_turned;  ///< by face
};

Parts partsOf(const TriangleMesh& mesh) {
  std::vector<std::vector<std::pair<std::uint32_t, bool>>> neighbours(mesh.triangles.size());
  forEachEdge(mesh, [&](std::span<const DirectedEdge> same) {
    if (same.size() != 2) return;
    const bool agrees = same[0].is_forward != same[1].is_forward;
    neighbours[same[0].face].emplace_back(same[1].face, agrees);
    neighbours[same[1].face].emplace_back(same[0].face, agrees);
  });
  Parts parts{{}, std::vector<bool>(mesh.triangles.size())};
  std::vector<bool> is_reached(mesh.triangles.size());
  for (std::uint32_t first = 0; first < mesh.triangles.size(); ++first) {
    if (is_reached[first]) continue;
    is_reached[first] = true;
    std::vector<std::uint32_t> part{first};
    std::size_t turned = 0;
    for (std::size_t i = 0; i < part.size(); ++i)
      for (const auto& [face, agrees] : neighbours[part[i]]) {
        if (is_reached[face]) continue;
        is_reached[face] = true;
        parts.is_turned[face] = parts.is_turned[part[i]] != !agrees;
        turned += parts.is_turned[face] ? 1U : 0U;
        part.push_back(face);
      }
    // most faces of a part stay as they are
    if (2 * turned > part.size())
      for (const std::uint32_t face : part) parts.is_turned[face] = !parts.is_turned[face];
    parts.faces.push_back(std::move(part));
  }
  return parts;
}

/// Turns the faces that disagree with most of their part, and then the parts that wind about their own faces
/// in the wrong direction. Returns the number of faces that were turned.
std::size_t orient(TriangleMesh& mesh) {
  Parts parts = partsOf(mesh);
  const std::vector<Triangle> original = mesh.triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (parts.is_turned[i]) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
  const TriangleTree tree(mesh);
  for (const std::vector<std::uint32_t>& part : parts.faces) {
    double sum = 0;
    for (const std::uint32_t i : part) {
      const auto c = cornersOf(mesh, mesh.triangles[i]);
      // on the surface of a body that is properly oriented it is 1/2, on one that is inside out -1/2
      sum += norm(cross(c[1] - c[0], c[2] - c[0])) * tree.winding((1.0 / 3) * (c[0] + c[1] + c[2]), i);
    }
    if (!(sum < 0)) continue;
    for (const std::uint32_t i : part) parts.is_turned[i] = !parts.is_turned[i];
  }
  std::size_t turned = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    mesh.triangles[i] = original[i];
    if (!parts.is_turned[i]) continue;
    std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    ++turned;
  }
  return turned;
}

/// Whether a face lies inside the body everywhere: at its centre, its corners and the middles of its edges.
bool isHidden(const TriangleTree& tree, const std::array<Vec3, 3>& c, std::uint32_t face) {
  constexpr double kOff = 0.02;  // of the corners, which other faces share
  constexpr std::array<std::array<double, 3>, 7> kShares{{{1.0 / 3, 1.0 / 3, 1.0 / 3},
                                                          {1 - 2 * kOff, kOff, kOff},
                                                          {kOff, 1 - 2 * kOff, kOff},
                                                          {kOff, kOff, 1 - 2 * kOff},
                                                          {0.5 - kOff / 2, 0.5 - kOff / 2, kOff},
                                                          {kOff, 0.5 - kOff / 2, 0.5 - kOff / 2},
                                                          {0.5 - kOff / 2, kOff, 0.5 - kOff / 2}}};
  return std::ranges::all_of(kShares, [&](const std::array<double, 3>& share) {
    return tree.winding(share[0] * c[0] + share[1] * c[1] + share[2] * c[2], face) > kHidden;
  });
}

std::vector<std::uint32_t> visibleFaces(const TriangleMesh& mesh, const TriangleTree& tree) {
  std::vector<std::uint32_t> visible;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    if (!isHidden(tree, cornersOf(mesh, mesh.triangles[i]), i)) visible.push_back(i);
  if (visible.empty()) {  // nothing but faces inside each other: leave all
    visible.resize(mesh.triangles.size());
    std::iota(visible.begin(), visible.end(), 0U);
  }
  return visible;
}

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
    const bool is_inside = is_known ? before.is_inside : isInside(place_m, distance_m <= band_m_);
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

  bool isInside(const Vec3& place_m, bool is_in_band) {
    const double number = body_.winding(place_m);
    if (!is_in_band) return number > kInside;
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

MeshBody::MeshBody(TriangleMesh mesh)
    : mesh_(std::move(mesh)),
      turned_faces_(orient(mesh_)),
      is_closed_(isClosedMesh(mesh_)),
      all_(mesh_),
      visible_(visibleFaces(mesh_, all_)),
      surface_(mesh_, visible_) {}

WindingRange sampleMesh(const MeshBody& body, double band_m, SampledField& grid, FarSamples far_samples) {
  return MeshSampling(body, band_m, grid).run(far_samples);
}

}  // namespace hapticd::solids
