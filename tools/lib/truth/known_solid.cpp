// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/known_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// By the nearest point x_i = a_i^2 p_i / (t + a_i^2), with t the greatest root of F(t) = sum (a_i p_i / (t +
/// a_i^2))^2 - 1. F is convex and falls from t0 on, where it is not negative, so Newton's steps do not pass
/// the root.
double fromEllipsoid(const Vec3& half_m, const Vec3& p) {
  const std::array<double, 3> a{half_m.x, half_m.y, half_m.z};
  const std::array<double, 3> q{std::abs(p.x), std::abs(p.y), std::abs(p.z)};
  double t = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) t = std::max(t, a[i] * q[i] - a[i] * a[i]);
  t = std::max(t, 1e-9 - std::pow(*std::ranges::min_element(a), 2));
  for (int step = 0; step < 16; ++step) {
    double value = -1;
    double slope = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double ratio = a[i] * q[i] / (t + a[i] * a[i]);
      value += ratio * ratio;
      slope -= 2 * ratio * ratio / (t + a[i] * a[i]);
    }
    if (!(value > 1e-13)) break;
    t -= value / slope;
  }
  double square = 0;
  for (std::size_t i = 0; i < 3; ++i) square += std::pow(q[i] * t / (t + a[i] * a[i]), 2);
  return std::copysign(std::sqrt(square), t);
}

double fromBox(const Vec3& half_m, const Vec3& p) {
  const Vec3 beyond{std::abs(p.x) - half_m.x, std::abs(p.y) - half_m.y, std::abs(p.z) - half_m.z};
  const Vec3 outside{std::max(beyond.x, 0.0), std::max(beyond.y, 0.0), std::max(beyond.z, 0.0)};
  return norm(outside) + std::min(0.0, std::max({beyond.x, beyond.y, beyond.z}));
}

/// The lesser of two distances, rounded where they differ by less than `round_m`; a lower bound of the
/// distance of a body with a fillet there.
double joinedSmoothly(double a, double b, double round_m) {
  const double share = std::max(round_m - std::abs(a - b), 0.0) / round_m;
  return std::min(a, b) - share * share * round_m / 4;
}

double fromOrgan(const Vec3& p) {
  struct Bump {
    Vec3 centre_m;
    double radius_m;
  };
  static constexpr Bump kBumps[] = {{{0.024, 0.012, 0.018}, 0.014},   {{-0.020, 0.018, 0.020}, 0.010},
                                    {{-0.012, -0.020, 0.021}, 0.013}, {{0.014, -0.024, 0.012}, 0.017},
                                    {{0.042, -0.006, 0.002}, 0.014},  {{-0.040, -0.010, 0.004}, 0.017},
                                    {{0.004, 0.034, 0.004}, 0.013},   {{-0.010, 0.010, -0.024}, 0.014}};
  constexpr double kRound_m = 0.008;
  double distance_m = fromEllipsoid({0.045, 0.036, 0.026}, p);
  for (const Bump& bump : kBumps)
    distance_m = joinedSmoothly(distance_m, norm(p - bump.centre_m) - bump.radius_m, kRound_m);
  return distance_m;
}

/// The cube's frame: its diagonal is z.
Vec3 inCube(const Vec3& p) {
  const double a = 1 / std::sqrt(2.0);
  const double b = 1 / std::sqrt(6.0);
  const double c = 1 / std::sqrt(3.0);
  return {p.x * a + p.y * b + p.z * c, -p.x * a + p.y * b + p.z * c, -2 * b * p.y + c * p.z};
}

double fromCylinder(double radius_m, double half_m, const Vec3& p) {
  const double round_m = std::hypot(p.y, p.z) - radius_m;
  const double end_m = std::abs(p.x) - half_m;
  return std::hypot(std::max(round_m, 0.0), std::max(end_m, 0.0)) + std::min(0.0, std::max(round_m, end_m));
}

/// Depth of a solid on a ray whose direction is (x, y, -1).
double depthOf(const PlacedSolid& solid, const Vec3& ray) {
  constexpr double kNothing = std::numeric_limits<double>::infinity();
  constexpr int kMaxSteps = 400;
  constexpr double kHit_m = 2e-6;
  const double length = norm(ray);
  const Vec3 eye_m = solid.T_world_solid.placeIn({});
  const Vec3 direction = (1 / length) * solid.T_world_solid.directionIn(ray);
  const double middle_m = -dot(eye_m, direction);
  const double radius_m = radiusOf(solid.kind);
  const double half2 = radius_m * radius_m - dot(eye_m, eye_m) + middle_m * middle_m;
  if (!(half2 > 0)) return kNothing;
  double along_m = std::max(0.0, middle_m - std::sqrt(half2));
  const double last_m = middle_m + std::sqrt(half2);
  for (int step = 0; step < kMaxSteps && along_m < last_m; ++step) {
    const double distance_m = distanceFrom(solid.kind, eye_m + along_m * direction);
    if (distance_m < kHit_m) return along_m / length;
    along_m += distance_m;
  }
  return kNothing;
}

/// Whether a ray from the origin passes the ball around a solid.
bool mayMeet(const PlacedSolid& solid, const Vec3& ray) {
  const Vec3& centre_m = solid.T_world_solid.position_m;
  const Vec3 beside = cross(ray, centre_m);
  const double radius_m = radiusOf(solid.kind);
  return dot(beside, beside) < radius_m * radius_m * dot(ray, ray);
}

}  // namespace

std::string_view nameOf(SolidKind kind) {
  constexpr std::array<std::string_view, kAllSolids.size()> kNames{
      "organ", "ellipsoid", "round_ellipsoid", "corner", "sphere", "cylinder", "plate"};
  return kNames.at(static_cast<std::size_t>(kind));
}

double distanceFrom(SolidKind kind, const Vec3& p) {
  switch (kind) {
    case SolidKind::organ:
      return fromOrgan(p);
    case SolidKind::ellipsoid:
      return fromEllipsoid({0.05, 0.04, 0.03}, p);
    case SolidKind::round_ellipsoid:
      return fromEllipsoid({0.05, 0.045, 0.04}, p);
    case SolidKind::corner:
      return fromBox({0.04, 0.04, 0.04}, inCube(p));
    case SolidKind::sphere:
      return norm(p) - 0.05;
    case SolidKind::cylinder:
      return fromCylinder(0.025, 0.06, p);
    case SolidKind::plate:
      return fromBox({0.06, 0.05, 0.0075}, p);
  }
  return std::numeric_limits<double>::infinity();
}

double radiusOf(SolidKind kind) {
  switch (kind) {
    case SolidKind::corner:
      return 0.0695;
    case SolidKind::cylinder:
      return 0.0655;
    case SolidKind::plate:
      return 0.079;
    case SolidKind::organ:
      return 0.06;
    default:
      return 0.0505;
  }
}

SolidGrid::SolidGrid(SolidKind kind, double spacing_m) {
  // Three samples beyond the solid on each side.
  const auto half = static_cast<std::uint32_t>(std::ceil(radiusOf(kind) / spacing_m)) + 3;
  const std::uint32_t edge = 2 * half + 1;
  grid_.samples = {edge, edge, edge};
  grid_.spacing_m = spacing_m;
  grid_.origin_m = -spacing_m * half * Vec3{1, 1, 1};
  grid_.scale_m = 5e-6;
  std::vector<float> samples;
  samples.reserve(grid_.size());
  for (std::uint32_t z = 0; z < edge; ++z) {
    for (std::uint32_t y = 0; y < edge; ++y) {
      for (std::uint32_t x = 0; x < edge; ++x)
        samples.push_back(static_cast<float>(distanceFrom(kind, grid_.origin_m + spacing_m * Vec3(x, y, z))));
    }
  }
  rt::toSplineCoefficients(samples, grid_.samples);
  coefficients_.reserve(samples.size() + 1);
  for (const float sample : samples) {
    const double counts = std::clamp(std::round(double{sample} / grid_.scale_m), -32767.0, 32767.0);
    coefficients_.push_back(static_cast<std::int16_t>(counts));
  }
  coefficients_.push_back(0);
  grid_.coefficients = coefficients_.data();
}

double depthOf(const std::vector<PlacedSolid>& solids, double wall_m, const Vec3& ray) {
  double depth_m = wall_m;
  for (const PlacedSolid& solid : solids) {
    if (mayMeet(solid, ray)) depth_m = std::min(depth_m, depthOf(solid, ray));
  }
  return depth_m;
}

void measure(const std::vector<PlacedSolid>& solids, double wall_m, drivers::SceneCamera& camera) {
  camera.measure([&](const Vec3& ray) { return 1 / depthOf(solids, wall_m, ray); });
}

}  // namespace hapticd::tools
