// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/mesh_repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace hapticd::solids {
namespace {

using Cell = std::array<std::int64_t, 3>;

struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t number : cell)
      hash = (hash ^ static_cast<std::uint64_t>(number)) * 0x9E3779B97F4A7C15ULL + (hash >> 29U);
    return static_cast<std::size_t>(hash ^ (hash >> 32U));
  }
};

/// Finds points that were added before, within a distance, by cells that are much wider than it.
class PointWelder {
 public:
  PointWelder(const rt::Vec3& low, double tolerance, std::size_t points)
      : low_(low), tolerance_(tolerance), cell_width_(8 * tolerance), next_(points, kNone) {
    first_.reserve(points);
  }

  /// Returns the first point that lies within the tolerance of point `index`, or `index` after adding it.
  std::uint32_t mergedWith(const std::vector<rt::Vec3>& points, std::uint32_t index) {
    const std::array<double, 3> place{points[index].x - low_.x, points[index].y - low_.y,
                                      points[index].z - low_.z};
    Cell low{}, high{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = static_cast<std::int64_t>(std::floor((place[axis] - tolerance_) / cell_width_));
      high[axis] = static_cast<std::int64_t>(std::floor((place[axis] + tolerance_) / cell_width_));
    }
    for (Cell cell = low; cell[0] <= high[0]; ++cell[0])
      for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1])
        for (cell[2] = low[2]; cell[2] <= high[2]; ++cell[2]) {
          const auto found = first_.find(cell);
          if (found == first_.end()) continue;
          for (std::uint32_t other = found->second; other != kNone; other = next_[other])
            if (norm(points[other] - points[index]) <= tolerance_) return other;
        }
    Cell own{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      own[axis] = static_cast<std::int64_t>(std::floor(place[axis] / cell_width_));
    const auto [slot, is_new] = first_.try_emplace(own, index);
    if (!is_new) next_[index] = std::exchange(slot->second, index);
    return index;
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  rt::Vec3 low_;
  double tolerance_, cell_width_;
  std::vector<std::uint32_t> next_;
  std::unordered_map<Cell, std::uint32_t, CellHash> first_;
};

void weld(TriangleMesh& mesh, Topology& topology) {
  const Bounds bounds = boundsOf(mesh.points_m);
  const double tolerance =
      std::max(kWeldShare * bounds.diagonal_m(), std::numeric_limits<double>::min() * 1e16);
  PointWelder welder(bounds.low_m, tolerance, mesh.points_m.size());
  std::vector<std::uint32_t> merged(mesh.points_m.size());
  double farthest_m = 0;
  for (std::uint32_t i = 0; i < merged.size(); ++i) {
    merged[i] = welder.mergedWith(mesh.points_m, i);
    if (merged[i] != i) ++topology.merged_points;
    farthest_m = std::max(farthest_m, norm(mesh.points_m[merged[i]] - mesh.points_m[i]));
  }
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& corner : triangle) corner = merged[corner];
  mesh.error_m += farthest_m;
}

void removeFlatAndDuplicate(TriangleMesh& mesh, Topology& topology) {
  topology.flat_faces_removed = std::erase_if(
      mesh.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  const auto sorted = [](Triangle triangle) {
    std::ranges::sort(triangle);
    return triangle;
  };
  std::vector<std::pair<Triangle, std::uint32_t>> order;
  order.reserve(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) order.emplace_back(sorted(mesh.triangles[i]), i);
  std::ranges::sort(order);
  std::vector<bool> is_duplicate(mesh.triangles.size());
  for (std::size_t i = 1; i < order.size(); ++i)
    if (order[i].first == order[i - 1].first) is_duplicate[order[i].second] = true;
  std::vector<Triangle> kept;
  kept.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (!is_duplicate[i]) kept.push_back(mesh.triangles[i]);
  topology.duplicate_faces_removed = mesh.triangles.size() - kept.size();
  mesh.triangles = std::move(kept);
}

void removeUnusedPoints(TriangleMesh& mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> place(mesh.points_m.size(), kUnused);
  std::vector<rt::Vec3> points_m;
  for (Triangle& triangle : mesh.triangles)
    for (std::uint32_t& corner : triangle) {
      if (place[corner] == kUnused) {
        place[corner] = static_cast<std::uint32_t>(points_m.size());
        points_m.push_back(mesh.points_m[corner]);
      }
      corner = place[corner];
    }
  mesh.points_m = std::move(points_m);
}

struct Edge {
  std::uint32_t low, high;
  bool is_forward;  ///< from low to high, in the order of its triangle
  auto operator<=>(const Edge&) const = default;
};

std::vector<Edge> sortedEdgesOf(const TriangleMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = triangle[i], to = triangle[(i + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), from < to});
    }
  std::ranges::sort(edges);
  return edges;
}

/// Joins boundary edges that share a point.
std::vector<Hole> holesOf(const TriangleMesh& mesh, const std::vector<Edge>& boundary) {
  std::unordered_map<std::uint32_t, std::uint32_t> parent;
  const auto rootOf = [&](std::uint32_t point) {
    parent.try_emplace(point, point);
    while (parent[point] != point) point = parent[point] = parent[parent[point]];
    return point;
  };
  for (const Edge& edge : boundary) {
    const std::uint32_t a = rootOf(edge.low), b = rootOf(edge.high);
    parent[a] = b;
  }
  struct Group {
    std::vector<rt::Vec3> points_m;
    std::size_t edges = 0;
  };
  std::unordered_map<std::uint32_t, Group> groups;
  for (const Edge& edge : boundary) {
    Group& group = groups[rootOf(edge.low)];
    group.points_m.push_back(mesh.points_m[edge.low]);
    group.points_m.push_back(mesh.points_m[edge.high]);
    ++group.edges;
  }
  std::vector<Hole> holes;
  for (const auto& [root, group] : groups) {
    const Bounds bounds = boundsOf(group.points_m);
    holes.push_back({0.5 * (bounds.low_m + bounds.high_m), bounds.diagonal_m(), group.edges});
  }
  std::ranges::sort(holes, [](const Hole& a, const Hole& b) {
    return std::tie(b.extent_m, a.centre_m.x, a.centre_m.y, a.centre_m.z) <
           std::tie(a.extent_m, b.centre_m.x, b.centre_m.y, b.centre_m.z);
  });
  return holes;
}

void inspectEdges(const TriangleMesh& mesh, Topology& topology) {
  const std::vector<Edge> edges = sortedEdgesOf(mesh);
  std::vector<Edge> boundary;
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin;
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
      ++end;
    if (end - begin == 1) boundary.push_back(edges[begin]);
    if (end - begin > 2) ++topology.crowded_edges;
    if (end - begin == 2 && edges[begin].is_forward == edges[begin + 1].is_forward) ++topology.reversed_edges;
    begin = end;
  }
  topology.boundary_edges = boundary.size();
  topology.holes = holesOf(mesh, boundary);
}

}  // namespace

Bounds boundsOf(const std::vector<rt::Vec3>& points_m) {
  Bounds bounds{points_m.front(), points_m.front()};
  for (const rt::Vec3& p : points_m) {
    bounds.low_m = {std::min(bounds.low_m.x, p.x), std::min(bounds.low_m.y, p.y),
                    std::min(bounds.low_m.z, p.z)};
    bounds.high_m = {std::max(bounds.high_m.x, p.x), std::max(bounds.high_m.y, p.y),
                     std::max(bounds.high_m.z, p.z)};
  }
  return bounds;
}

Topology repair(TriangleMesh& mesh) {
  Topology topology;
  removeUnusedPoints(mesh);  // one far away would make those that are the same few and far between
  if (mesh.points_m.empty()) return topology;
  weld(mesh, topology);
  removeFlatAndDuplicate(mesh, topology);
  removeUnusedPoints(mesh);
  inspectEdges(mesh, topology);
  return topology;
}

}  // namespace hapticd::solids
