// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/solids/solids.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <utility>

namespace hapticd::tools {
namespace {

using rt::Vec3;
using solids::Triangle;
using solids::TriangleMesh;

constexpr double kHalf_m = 0.015;
constexpr double kTube_m = 0.006;
constexpr double kHalfPlate_m = 0.0005;
constexpr double kBall_m = 0.006;
constexpr double kBump_m = 0.0007;
constexpr double kBumps = 7;  ///< radians of a bump's wave per radius

/// The surface of a cube from -1 to 1, every face in a grid of `counts` cells along x, y and z, and each
/// point moved by `place`. Points on edges belong to two faces; repair() of the readers merges them.
TriangleMesh cubeMesh(const std::array<int, 3>& counts, const std::function<Vec3(const Vec3&)>& place) {
  TriangleMesh mesh;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto first = static_cast<std::uint32_t>(mesh.points_m.size());
      const auto nu = static_cast<std::uint32_t>(counts[u]), nv = static_cast<std::uint32_t>(counts[v]);
      for (std::uint32_t j = 0; j <= nv; ++j)
        for (std::uint32_t i = 0; i <= nu; ++i) {
          std::array<double, 3> p{};
          p[axis] = side;
          p[u] = 2.0 * i / nu - 1;
          p[v] = 2.0 * j / nv - 1;
          mesh.points_m.push_back(place({p[0], p[1], p[2]}));
        }
      const auto at = [&](std::uint32_t i, std::uint32_t j) { return first + j * (nu + 1) + i; };
      for (std::uint32_t j = 0; j < nv; ++j)
        for (std::uint32_t i = 0; i < nu; ++i) {
          Triangle a{at(i, j), at(i + 1, j), at(i + 1, j + 1)}, b{at(i, j), at(i + 1, j + 1), at(i, j + 1)};
          if (side < 0) {
            std::swap(a[1], a[2]);
            std::swap(b[1], b[2]);
          }
          mesh.triangles.push_back(a);
          mesh.triangles.push_back(b);
        }
    }
  solids::repair(mesh);
  return mesh;
}

/// A place on a cube as a direction; equal steps along the cube become about equal angles.
Vec3 onUnitSphere(const Vec3& p) {
  const auto warped = [](double x) { return std::tan(x * std::numbers::pi / 4); };
  const Vec3 q{warped(p.x), warped(p.y), warped(p.z)};
  return (1 / norm(q)) * q;
}

Body boxOf(const Vec3& half, const std::array<int, 3>& counts) {
  Body body{cubeMesh(counts,
                     [&](const Vec3& p) {
                       return Vec3{half.x * p.x, half.y * p.y, half.z * p.z};
                     }),
            {},
            false};
  for (const double a : {-1.0, 1.0})
    for (const double b : {-1.0, 1.0}) {
      body.edges.push_back({Vec3{-half.x, a * half.y, b * half.z}, Vec3{half.x, a * half.y, b * half.z}});
      body.edges.push_back({Vec3{a * half.x, -half.y, b * half.z}, Vec3{a * half.x, half.y, b * half.z}});
      body.edges.push_back({Vec3{a * half.x, b * half.y, -half.z}, Vec3{a * half.x, b * half.y, half.z}});
    }
  return body;
}

Body torusOf(int divisions) {
  Body body;
  const auto around = static_cast<std::uint32_t>(8 * divisions),
             across = static_cast<std::uint32_t>(3 * divisions);
  const auto angle = [](std::uint32_t i, std::uint32_t n) { return 2 * std::numbers::pi * i / n; };
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double u = angle(i, around), v = angle(j, across), r = kHalf_m + kTube_m * std::cos(v);
      body.mesh.points_m.push_back({r * std::cos(u), r * std::sin(u), kTube_m * std::sin(v)});
    }
  const auto at = [=](std::uint32_t i, std::uint32_t j) { return i % around * across + j % across; };
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      body.mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      body.mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return body;
}

Body roundOf(int divisions, double bump_m) {
  return {cubeMesh({2 * divisions, 2 * divisions, 2 * divisions},
                   [&](const Vec3& p) {
                     const Vec3 u = onUnitSphere(p);
                     const double wave =
                         std::sin(kBumps * u.x) * std::sin(kBumps * u.y) + std::sin(kBumps * u.z);
                     return (kHalf_m + bump_m * wave) * u;
                   }),
          {},
          false};
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto shift = static_cast<std::uint32_t>(mesh.points_m.size());
  mesh.points_m.insert(mesh.points_m.end(), other.points_m.begin(), other.points_m.end());
  for (const Triangle& t : other.triangles)
    mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
}

/// The part of a mesh outside another body. A face that its surface cuts is divided, and of its smallest
/// pieces those count whose centre is outside; where they end, the seam, is appended to `seam`.
TriangleMesh outsideOf(const TriangleMesh& mesh, const std::function<bool(const Vec3&)>& is_inside,
                       std::vector<Segment>& seam) {
  constexpr int kDivisions = 6;
  TriangleMesh result;
  const std::function<void(const Vec3&, const Vec3&, const Vec3&, int)> take =
      [&](const Vec3& a, const Vec3& b, const Vec3& c, int left) {
        const bool in_a = is_inside(a), in_b = is_inside(b), in_c = is_inside(c);
        const bool is_cut = in_a != in_b || in_b != in_c;
        if (is_cut && left > 0) {
          const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
          if (left == kDivisions) seam.push_back({(1.0 / 3) * (a + b + c), (1.0 / 3) * (a + b + c)});
          take(a, ab, ca, left - 1);
          take(ab, b, bc, left - 1);
          take(ca, bc, c, left - 1);
          take(ab, bc, ca, left - 1);
          return;
        }
        if (is_cut ? is_inside((1.0 / 3) * (a + b + c)) : in_a) return;
        const auto first = static_cast<std::uint32_t>(result.points_m.size());
        for (const Vec3& p : {a, b, c}) result.points_m.push_back(p);
        result.triangles.push_back({first, first + 1, first + 2});
      };
  for (const Triangle& t : mesh.triangles)
    take(mesh.points_m[t[0]], mesh.points_m[t[1]], mesh.points_m[t[2]], kDivisions);
  return result;
}

/// Where the ball crosses a body, and where a hole is.
Vec3 placeOfDamage(const TriangleMesh& mesh) {
  const Vec3 towards{0.3, 0.5, 1};
  return *std::ranges::max_element(
      mesh.points_m, {}, [&](const Vec3& p) { return p.z - norm(cross(p, (1 / norm(towards)) * towards)); });
}

DamagedBody crossed(const Body& body) {
  const Vec3 centre = placeOfDamage(body.mesh);
  TriangleMesh ball = roundOf(24, 0).mesh;
  for (Vec3& p : ball.points_m) p = centre + kBall_m / kHalf_m * p;
  DamagedBody result{body.mesh, body};
  append(result.mesh, ball);
  const solids::TriangleTree of_body(body.mesh), of_ball(ball);
  result.truth.mesh = outsideOf(
      body.mesh, [&](const Vec3& p) { return norm(p - centre) < kBall_m && of_ball.winding(p) > 0.5; },
      result.truth.edges);
  append(result.truth.mesh,
         outsideOf(
             ball, [&](const Vec3& p) { return of_body.winding(p) > 0.5; }, result.truth.edges));
  return result;
}

}  // namespace

Body makeBody(BodyKind kind, int divisions) {
  switch (kind) {
    case BodyKind::box:
      return boxOf({kHalf_m, kHalf_m, kHalf_m}, {divisions, divisions, divisions});
    case BodyKind::sphere:
      return roundOf(divisions, 0);
    case BodyKind::torus:
      return torusOf(divisions);
    case BodyKind::bumpy:
      return roundOf(divisions, kBump_m);
    case BodyKind::plate:
      break;
  }
  Body plate = boxOf({kHalf_m, kHalf_m, kHalfPlate_m}, {divisions, divisions, std::max(1, divisions / 30)});
  plate.is_thin = true;
  return plate;
}

DamagedBody damaged(const Body& body, Damage damage, unsigned seed) {
  constexpr double kShare = 0.05;
  std::mt19937_64 random(seed);
  const auto isChosen = [&] { return std::uniform_real_distribution<double>(0, 1)(random) < kShare; };
  DamagedBody result{body.mesh, body};
  std::vector<Triangle>& faces = result.mesh.triangles;
  switch (damage) {
    case Damage::none:
      break;
    case Damage::missing:
      std::erase_if(faces, [&](const Triangle&) { return isChosen(); });
      break;
    case Damage::turned:
      for (Triangle& t : faces)
        if (isChosen()) std::swap(t[0], t[1]);
      break;
    case Damage::doubled:
      for (const Triangle& t : body.mesh.triangles) faces.push_back({t[1], t[0], t[2]});
      break;
    case Damage::crossing:
      return crossed(body);
    case Damage::hole: {
      const Vec3 centre = placeOfDamage(body.mesh);
      std::erase_if(faces,
                    [&](const Triangle& t) { return norm(body.mesh.points_m[t[0]] - centre) < kHole_m; });
      break;
    }
  }
  return result;
}

namespace {

Vec3 nearestOfSegment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 along = b - a;
  const double length2 = dot(along, along);
  return length2 > 0 ? a + std::clamp(dot(p - a, along) / length2, 0.0, 1.0) * along : a;
}

}  // namespace

Vec3 nearestOfTriangle(const std::array<Vec3, 3>& c, const Vec3& p) {
  const Vec3 normal = cross(c[1] - c[0], c[2] - c[0]);
  const double area2 = dot(normal, normal);
  bool is_above = area2 > 0;
  for (std::size_t i = 0; i < 3 && is_above; ++i)
    is_above = dot(cross(c[(i + 1) % 3] - c[i], p - c[i]), normal) >= 0;
  if (is_above) return p - (dot(p - c[0], normal) / area2) * normal;
  Vec3 best = nearestOfSegment(c[0], c[1], p);
  for (std::size_t i = 1; i < 3; ++i) {
    const Vec3 other = nearestOfSegment(c[i], c[(i + 1) % 3], p);
    if (norm(other - p) < norm(best - p)) best = other;
  }
  return best;
}

ExactPlace ExactSurface::at(const Vec3& place_m) const {
  return at(place_m, tree_.winding(place_m) > 0.5);
}

ExactPlace ExactSurface::at(const Vec3& place_m, bool is_inside) const {
  const double sign = is_inside ? -1 : 1;
  const Vec3 foot_m = nearestOfTriangle(tree_.corners_m(tree_.nearest(place_m).triangle), place_m);
  const double distance_m = norm(place_m - foot_m);
  return {sign * distance_m, foot_m, distance_m > 0 ? (sign / distance_m) * (place_m - foot_m) : Vec3{}};
}

bool ExactSurface::isNearEdge(const Vec3& foot_m, double reach_m) const {
  return std::ranges::any_of(edges_, [&](const Segment& edge) {
    return norm(nearestOfSegment(edge[0], edge[1], foot_m) - foot_m) < reach_m;
  });
}

bool ExactSurface::isAloneFor(const ExactPlace& place, double reach_m) const {
  constexpr double kShare = 0.99;
  const bool is_inside = place.distance_m < 0;
  const Vec3 away = is_inside ? -place.gradient : place.gradient;
  const Vec3 farther_m = place.foot_m + (std::abs(place.distance_m) + reach_m) * away;
  return std::abs(at(farther_m, is_inside).distance_m) >= std::abs(place.distance_m) + kShare * reach_m;
}

}  // namespace hapticd::tools
