// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/surface_patch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kNowhere = std::numeric_limits<double>::infinity();

/// `v` as a unit vector, or `otherwise` where it has no direction.
Vec3 unit(const Vec3& v, const Vec3& otherwise) {
  const double length = norm(v);
  return length > 0 ? (1 / length) * v : otherwise;
}

/// The depths at which a ray meets a sphere, the nearer first; not numbers where it does not.
struct Crossings {
  double nearer;
  double farther;
};
Crossings crossings(const Vec3& ray, const Vec3& centre, double radius) {
  const double a = dot(ray, ray);
  const double along = dot(ray, centre);
  const double c = dot(centre, centre) - radius * radius;
  const double root = std::sqrt(along * along - a * c);
  return {(along - root) / a, (along + root) / a};
}

}  // namespace

Vec3 Strip::closest(const Vec3& p) const {
  const Vec3 foot = p - dot(outward, p - origin_m) * outward;
  const double place = dot(across, foot - origin_m);
  return foot + (std::clamp(place, first_m, last_m) - place) * across;
}

double Strip::depth(const Vec3& ray) const {
  const double facing = dot(outward, ray);
  if (facing >= 0) return kNowhere;
  const double depth = dot(outward, origin_m) / facing;
  const double place = dot(across, depth * ray - origin_m);
  return depth > 0 && place >= first_m && place <= last_m ? depth : kNowhere;
}

Vec3 Strip::normal(const Vec3&) const {
  return outward;
}

Vec3 Round::across(const Vec3& v) const {
  return {v.x, is_cylinder ? 0 : v.y, v.z};
}

Vec3 Round::closest(const Vec3& p) const {
  const Vec3 to_camera = -(1 / norm(centre_m)) * centre_m;
  const double limb_cosine = radius_m / norm(centre_m);
  const Vec3 from_centre = across(p - centre_m);
  Vec3 direction = unit(from_centre, to_camera);
  if (dot(direction, to_camera) < limb_cosine) {  // the camera does not see that side
    const Vec3 aside = unit(from_centre - dot(from_centre, to_camera) * to_camera, {1, 0, 0});
    direction = limb_cosine * to_camera + std::sqrt(1 - limb_cosine * limb_cosine) * aside;
  }
  const Vec3 along_axis = (p - centre_m) - from_centre;
  return centre_m + along_axis + radius_m * direction;
}

double Round::depth(const Vec3& ray) const {
  const double depth = crossings(across(ray), centre_m, radius_m).nearer;
  return depth > 0 ? depth : kNowhere;
}

Vec3 Round::normal(const Vec3& p) const {
  return unit(across(p - centre_m), {0, 0, 1});
}

double Round::signedDistance(const Vec3& p) const {
  return norm(across(p - centre_m)) - radius_m;
}

Vec3 Bowl::closest(const Vec3& p) const {
  Vec3 from_centre = p - centre_m;
  from_centre.z = std::min(from_centre.z, 0.0);
  return centre_m + radius_m * unit(from_centre, {0, 0, -1});
}

double Bowl::depth(const Vec3& ray) const {
  const double depth = crossings(ray, centre_m, radius_m).farther;
  return depth >= -centre_m.z ? depth : kNowhere;
}

Vec3 Bowl::normal(const Vec3& p) const {
  return unit(centre_m - p, {0, 0, 1});
}

Vec3 HoledWall::closest(const Vec3& p) const {
  const Vec3 from_axis{p.x - centre_m.x, p.y - centre_m.y, 0};
  return centre_m + std::max(norm(from_axis), radius_m) * unit(from_axis, {1, 0, 0});
}

double HoledWall::depth(const Vec3& ray) const {
  const double depth = -centre_m.z;
  return norm(Vec3{depth * ray.x - centre_m.x, depth * ray.y - centre_m.y, 0}) >= radius_m ? depth : kNowhere;
}

Vec3 HoledWall::normal(const Vec3&) const {
  return {0, 0, 1};
}

}  // namespace hapticd::tools
