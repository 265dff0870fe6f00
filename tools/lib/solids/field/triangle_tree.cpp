// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

namespace hapticd::solids {
namespace {

using rt::cross;
using rt::dot;
using rt::Vec3;
using Corners = std::array<Vec3, 3>;

constexpr std::uint32_t kLeafTriangles = 6;
/// Halving four billion triangles takes 32 levels.
constexpr std::size_t kMaxDepth = 64;

Vec3 centroidOf(const Corners& c) {
  return (1.0 / 3) * (c[0] + c[1] + c[2]);
}
Vec3 areaNormalOf(const Corners& c) {
  return 0.5 * cross(c[1] - c[0], c[2] - c[0]);
}

double squaredToSegment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double length2 = dot(along, along);
  const double share = length2 > 0 ? std::clamp(dot(p - a, along) / length2, 0.0, 1.0) : 0;
  const Vec3 offset = p - a - share * along;
  return dot(offset, offset);
}

double squaredOf(const Vec3& v) {
  return dot(v, v);
}

/// By the regions of the triangle's plane in which a corner, an edge or the inside is nearest. Also of a
/// triangle without area, which is its longest edge.
/// Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
double squaredToTriangle(const Vec3& p, const Corners& c) {
  const Vec3 ab = c[1] - c[0], ac = c[2] - c[0], ap = p - c[0];
  const double ab_ap = dot(ab, ap), ac_ap = dot(ac, ap);
  if (ab_ap <= 0 && ac_ap <= 0) return squaredOf(ap);
  const Vec3 bp = p - c[1];
  const double ab_bp = dot(ab, bp), ac_bp = dot(ac, bp);
  if (ab_bp >= 0 && ac_bp <= ab_bp) return squaredOf(bp);
  const Vec3 cp = p - c[2];
  const double ab_cp = dot(ab, cp), ac_cp = dot(ac, cp);
  if (ac_cp >= 0 && ab_cp <= ac_cp) return squaredOf(cp);
  // weights of the corners, of which rounding leaves nothing where the triangle is nearly a line
  const double weight_c = ab_ap * ac_bp - ab_bp * ac_ap, weight_b = ab_cp * ac_ap - ab_ap * ac_cp,
               weight_a = ab_bp * ac_cp - ab_cp * ac_bp;
  const double sum = weight_a + weight_b + weight_c;
  constexpr double kFlat = 1e-12;
  if (!(sum > kFlat * dot(ab, ab) * dot(ac, ac)))
    return std::min(
        {squaredToSegment(p, c[0], c[1]), squaredToSegment(p, c[1], c[2]), squaredToSegment(p, c[2], c[0])});
  if (weight_c <= 0 && ab_ap >= 0 && ab_bp <= 0) return squaredOf(ap - ab_ap / (ab_ap - ab_bp) * ab);
  if (weight_b <= 0 && ac_ap >= 0 && ac_cp <= 0) return squaredOf(ap - ac_ap / (ac_ap - ac_cp) * ac);
  const double from_b = ac_bp - ab_bp, from_c = ab_cp - ac_cp;
  if (weight_a <= 0 && from_b >= 0 && from_c >= 0)
    return squaredOf(bp - from_b / (from_b + from_c) * (c[2] - c[1]));
  return squaredOf(ap - (weight_b / sum) * ab - (weight_c / sum) * ac);
}

double squaredToBox(const Vec3& p, const Vec3& low, const Vec3& high) {
  const double x = std::max({low.x - p.x, 0.0, p.x - high.x}), y = std::max({low.y - p.y, 0.0, p.y - high.y}),
               z = std::max({low.z - p.z, 0.0, p.z - high.z});
  return x * x + y * y + z * z;
}

/// Solid angle, with a sign, of a triangle seen from p. Source: van Oosterom and Strackee 1983.
double solidAngle(const Vec3& p, const Corners& corners) {
  const Vec3 a = corners[0] - p, b = corners[1] - p, c = corners[2] - p;
  const double la = norm(a), lb = norm(b), lc = norm(c);
  const double volume = dot(a, cross(b, c));
  return 2 * std::atan2(volume, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

double coordinate(const Vec3& v, int axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh, Effort* effort)
    : effort_(effort), triangle_(mesh.triangles.size()), place_(mesh.triangles.size()) {
  std::iota(triangle_.begin(), triangle_.end(), 0U);
  corners_m_.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    corners_m_.push_back({mesh.points_m[t[0]], mesh.points_m[t[1]], mesh.points_m[t[2]]});
  // sorts both alike
  build(0, static_cast<std::uint32_t>(triangle_.size()));
  for (std::uint32_t i = 0; i < triangle_.size(); ++i) place_[triangle_[i]] = i;
}

TriangleTree::Box TriangleTree::boxOf(std::uint32_t begin, std::uint32_t end) const {
  Box box{corners_m_[begin][0], corners_m_[begin][0]};
  for (std::uint32_t i = begin; i < end; ++i)
    for (const Vec3& p : corners_m_[i]) {
      box.low_m = {std::min(box.low_m.x, p.x), std::min(box.low_m.y, p.y), std::min(box.low_m.z, p.z)};
      box.high_m = {std::max(box.high_m.x, p.x), std::max(box.high_m.y, p.y), std::max(box.high_m.z, p.z)};
    }
  return box;
}

TriangleTree::Dipole TriangleTree::dipoleOf(std::uint32_t begin, std::uint32_t end) const {
  Dipole dipole;
  double area = 0;
  Vec3 weighted, plain;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Vec3 normal = areaNormalOf(corners_m_[i]), centroid = centroidOf(corners_m_[i]);
    dipole.area_normal_m2 += normal;
    area += norm(normal);
    weighted += norm(normal) * centroid;
    plain += centroid;
  }
  dipole.centre_m = area > 0 ? (1 / area) * weighted : (1.0 / (end - begin)) * plain;
  for (std::uint32_t i = begin; i < end; ++i)
    for (const Vec3& p : corners_m_[i]) {
      const Vec3 offset = p - dipole.centre_m;
      dipole.squared_far_m2 = std::max(dipole.squared_far_m2, kFar * kFar * dot(offset, offset));
    }
  return dipole;
}

std::uint32_t TriangleTree::build(std::uint32_t begin, std::uint32_t end) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  Node node{boxOf(begin, end), begin, end, 0};
  nodes_.push_back(node);
  dipoles_.push_back(dipoleOf(begin, end));
  if (end - begin > kLeafTriangles) {
    const Vec3 extent = node.box_m.high_m - node.box_m.low_m;
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    // sorts indices, then both arrays alike
    std::vector<std::uint32_t> order(end - begin);
    std::iota(order.begin(), order.end(), begin);
    const auto middle = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
    std::ranges::nth_element(order, middle, {}, [&](std::uint32_t i) {
      const Corners& c = corners_m_[i];
      return coordinate(c[0], axis) + coordinate(c[1], axis) + coordinate(c[2], axis);
    });
    std::vector<Corners> corners;
    std::vector<std::uint32_t> triangles;
    for (const std::uint32_t i : order) {
      corners.push_back(corners_m_[i]);
      triangles.push_back(triangle_[i]);
    }
    std::ranges::copy(corners, corners_m_.begin() + begin);
    std::ranges::copy(triangles, triangle_.begin() + begin);
    const std::uint32_t split = begin + (end - begin) / 2;
    build(begin, split);
    node.right = build(split, end);
  }
  nodes_[index].right = node.right;
  return index;
}

double TriangleTree::squaredDistance(const Vec3& point_m, std::uint32_t triangle) const {
  return squaredToTriangle(point_m, corners_m(triangle));
}

NearestTriangle TriangleTree::nearest(const Vec3& point_m, NearestTriangle best) const {
  struct Waiting {
    std::uint32_t node;
    double squared_m2;
  };
  std::array<Waiting, kMaxDepth> waiting;
  std::size_t count = 0;
  waiting[count++] = {0, squaredToBox(point_m, nodes_[0].box_m.low_m, nodes_[0].box_m.high_m)};
  std::uint64_t steps = 0;
  while (count > 0 && !isSpent()) {
    const Waiting next = waiting[--count];
    ++steps;
    if (next.squared_m2 >= best.squared_m2) continue;
    const Node& node = nodes_[next.node];
    if (node.isLeaf()) {
      steps += kStepsOfTriangle * (node.end - node.begin);
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        const double squared = squaredToTriangle(point_m, corners_m_[i]);
        if (squared < best.squared_m2) best = {triangle_[i], squared};
      }
      continue;
    }
    const Box& left_m = nodes_[next.node + 1].box_m;
    const Box& right_m = nodes_[node.right].box_m;
    Waiting first{next.node + 1, squaredToBox(point_m, left_m.low_m, left_m.high_m)};
    Waiting second{node.right, squaredToBox(point_m, right_m.low_m, right_m.high_m)};
    if (first.squared_m2 > second.squared_m2) std::swap(first, second);
    if (second.squared_m2 < best.squared_m2) waiting[count++] = second;
    waiting[count++] = first;
  }
  take(steps);
  return best;
}

double TriangleTree::winding(const Vec3& point_m, std::uint32_t without) const {
  std::array<std::uint32_t, kMaxDepth> waiting;
  std::size_t count = 0;
  waiting[count++] = 0;
  const std::uint32_t left_out = without == kNone ? kNone : place_[without];
  double sum = 0;
  std::uint64_t steps = 0;
  while (count > 0 && !isSpent()) {
    const std::uint32_t index = waiting[--count];
    ++steps;
    const Dipole& dipole = dipoles_[index];
    const Node& node = nodes_[index];
    const Vec3 offset = dipole.centre_m - point_m;
    const double squared = dot(offset, offset);
    if (squared > dipole.squared_far_m2) {
      sum += dot(dipole.area_normal_m2, offset) / (squared * std::sqrt(squared));
    } else if (node.isLeaf()) {
      steps += kStepsOfTriangle * (node.end - node.begin);
      for (std::uint32_t i = node.begin; i < node.end; ++i)
        if (i != left_out) sum += solidAngle(point_m, corners_m_[i]);
    } else {
      waiting[count++] = node.right;
      waiting[count++] = index + 1;
    }
  }
  take(steps);
  return sum / (4 * std::numbers::pi);
}

std::optional<RayHit> TriangleTree::firstHit(const Vec3& from_m, const Vec3& direction,
                                             std::uint32_t without) const {
  const Vec3 inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};
  const std::uint32_t left_out = without == kNone ? kNone : place_[without];
  double best = std::numeric_limits<double>::infinity();
  std::uint32_t found = kNone;
  const auto entry = [&](const Node& node) {
    double near = 0, far = best;
    for (int axis = 0; axis < 3; ++axis) {
      const double a =
          (coordinate(node.box_m.low_m, axis) - coordinate(from_m, axis)) * coordinate(inverse, axis);
      const double b =
          (coordinate(node.box_m.high_m, axis) - coordinate(from_m, axis)) * coordinate(inverse, axis);
      // the comparisons drop what is not a number, of a ray in the plane of a face of the box
      near = std::max(near, std::min(a, b));
      far = std::min(far, std::max(a, b));
    }
    return near <= far;
  };
  std::array<std::uint32_t, kMaxDepth> waiting;
  std::size_t count = 0;
  waiting[count++] = 0;
  std::uint64_t steps = 0;
  while (count > 0 && !isSpent()) {
    const std::uint32_t index = waiting[--count];
    const Node& node = nodes_[index];
    ++steps;
    if (!entry(node)) continue;
    if (!node.isLeaf()) {
      waiting[count++] = node.right;
      waiting[count++] = index + 1;
      continue;
    }
    steps += kStepsOfTriangle * (node.end - node.begin);
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      if (i == left_out) continue;
      const Corners& c = corners_m_[i];
      const Vec3 ab = c[1] - c[0], ac = c[2] - c[0], across = cross(direction, ac);
      const double determinant = dot(ab, across);
      if (determinant == 0) continue;
      const Vec3 offset = from_m - c[0], second = cross(offset, ab);
      const double u = dot(offset, across) / determinant, v = dot(direction, second) / determinant;
      const double distance = dot(ac, second) / determinant;
      if (u < 0 || v < 0 || u + v > 1 || distance <= 0 || distance >= best) continue;
      best = distance;
      found = i;
    }
  }
  take(steps);
  if (found == kNone) return std::nullopt;
  return RayHit{triangle_[found], best};
}

}  // namespace hapticd::solids
