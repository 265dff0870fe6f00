// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/true_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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

namespace {

using rt::Vec3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDiagonal = 1 / std::numbers::sqrt2;  // sine and cosine of 45 degrees
constexpr double kBesideEdge_m = 0.01;                 // from an edge to where the HIP is pushed in

Vec3 closestOf(const SurfacePatch& patch, const Vec3& p) {
  return std::visit([&p](const auto& piece) { return piece.closest(p); }, patch);
}

double depthOf(const SurfacePatch& patch, const Vec3& ray) {
  return std::visit([&ray](const auto& piece) { return piece.depth(ray); }, patch);
}

/// Fronto-parallel, from `left` to `right`.
Strip facing(double distance, double left, double right) {
  return {{0, 0, -distance}, {0, 0, 1}, {1, 0, 0}, left, right};
}

/// Returns a strip at `x`, seen edge-on, from `distance` to `farther`; `outward_x` is +1 or -1.
Strip edgeOn(double x, double outward_x, double distance, double farther) {
  return {{x, 0, 0}, {outward_x, 0, 0}, {0, 0, -1}, distance, farther};
}

}  // namespace

TrueScene::TrueScene(const TrueSceneParameters& parameters, const rt::DepthModelParameters& depth_model,
                     std::uint32_t seed)
    : parameters_(parameters), camera_(depth_model), sensor_(seed) {}

TrueScene::Surface TrueScene::surfaceAt(double t_s) const {
  const double distance = distanceAt(t_s);
  const double radius = parameters_.radius_m;
  const Vec3 front{0, 0, -distance};
  switch (parameters_.kind) {
    case SceneKind::plane: {
      const double sine = std::sin(parameters_.tilt_rad);
      const double cosine = std::cos(parameters_.tilt_rad);
      return {{{Strip{front, {0, -sine, cosine}, {1, 0, 0}, -kInfinity, kInfinity}, 0}}, {}};
    }
    case SceneKind::sphere:
    case SceneKind::cylinder:
      return {{{Round{{0, 0, -distance - radius}, radius, parameters_.kind == SceneKind::cylinder}, 0}}, {}};
    case SceneKind::bowl: {
      const Vec3 centre{0, 0, radius - distance};
      return {{{Bowl{centre, radius}, 0}, {HoledWall{centre, radius}, 0}}, {}};
    }
    case SceneKind::convex_edge:
      return {{{Strip{front, {-kDiagonal, 0, kDiagonal}, {-kDiagonal, 0, -kDiagonal}, 0, kInfinity}, 0},
               {Strip{front, {kDiagonal, 0, kDiagonal}, {kDiagonal, 0, -kDiagonal}, 0, kInfinity}, 0}},
              {}};
    case SceneKind::inner_corner:
      return {{{Strip{front, {kDiagonal, 0, kDiagonal}, {-kDiagonal, 0, kDiagonal}, 0, kInfinity}, 0},
               {Strip{front, {-kDiagonal, 0, kDiagonal}, {kDiagonal, 0, kDiagonal}, 0, kInfinity}, 0}},
              {}};
    case SceneKind::half_plane:
      return {{{facing(distance, -kInfinity, 0), 0}}, {edgeOn(0, 1, distance, kInfinity)}};
    case SceneKind::thin_plate: {
      const double half = parameters_.plate_width_m / 2;
      const double back = distance + parameters_.plate_thickness_m;
      const double wall = distance + parameters_.wall_behind_m;
      const double shadow = half * wall / distance;
      return {{{facing(distance, -half, half), 0},
               {facing(wall, -kInfinity, -shadow), 1},
               {facing(wall, shadow, kInfinity), 1}},
              {edgeOn(-half, -1, distance, back), edgeOn(half, 1, distance, back), facing(back, -half, half),
               facing(wall, -shadow, shadow)}};
    }
    case SceneKind::step: {
      const double farther = distance + parameters_.step_m;
      return {{{facing(distance, -kInfinity, 0), 0}, {facing(farther, 0, kInfinity), 1}},
              {edgeOn(0, 1, distance, farther)}};
    }
  }
  return {};
}

/// Whether `p` is inside the solid, for scenes of flat pieces and the bowl; `distance_m` is where the scene
/// is.
bool TrueScene::isSolid(const Vec3& p, double distance_m) const {
  const double behind = -p.z - distance_m;  // how far behind the foremost point
  switch (parameters_.kind) {
    case SceneKind::convex_edge:
      return behind > std::abs(p.x);
    case SceneKind::inner_corner:
      return behind > -std::abs(p.x);
    case SceneKind::half_plane:
      return p.x < 0 && behind > 0;
    case SceneKind::thin_plate:
      return behind > parameters_.wall_behind_m || (std::abs(p.x) < parameters_.plate_width_m / 2 &&
                                                    behind > 0 && behind < parameters_.plate_thickness_m);
    case SceneKind::step:
      return behind > (p.x < 0 ? 0 : parameters_.step_m);
    case SceneKind::bowl: {
      const Vec3 centre{0, 0, parameters_.radius_m - distance_m};
      return p.z < centre.z && norm(p - centre) > parameters_.radius_m;
    }
    case SceneKind::plane:
    case SceneKind::sphere:
    case SceneKind::cylinder:
      break;
  }
  return false;
}

double TrueScene::signedDistance(const Vec3& p, double t_s) const {
  const Surface surface = surfaceAt(t_s);
  if (const Round* round = std::get_if<Round>(&surface.visible.front().patch))
    return round->signedDistance(p);
  if (parameters_.kind == SceneKind::plane) {
    const Strip& plane = std::get<Strip>(surface.visible.front().patch);
    return dot(plane.outward, p - plane.origin_m);
  }
  double distance = kInfinity;
  for (const VisiblePatch& seen : surface.visible) {
    distance = std::min(distance, norm(p - closestOf(seen.patch, p)));
  }
  for (const SurfacePatch& patch : surface.hidden)
    distance = std::min(distance, norm(p - closestOf(patch, p)));
  return isSolid(p, distanceAt(t_s)) ? -distance : distance;
}

namespace {

/// The patch in front of `p` on the line of sight, or nullptr.
template <typename Patches>
auto inFrontOf(const Patches& visible, const Vec3& p) {
  decltype(&visible.front()) first = nullptr;
  double depth = -p.z;
  for (const auto& seen : visible) {
    const double met = depthOf(seen.patch, -(1 / p.z) * p);
    if (met > depth) continue;
    depth = met;
    first = &seen;
  }
  return first;
}

/// The patch that is closest to `p` among those of `sheet`, or among all when `sheet` is negative.
template <typename Patches>
const auto& closestPatch(const Patches& visible, const Vec3& p, int sheet) {
  const auto* closest = &visible.front();
  double distance = kInfinity;
  for (const auto& seen : visible) {
    const double candidate = norm(p - closestOf(seen.patch, p));
    if ((sheet >= 0 && seen.sheet != sheet) || candidate >= distance) continue;
    distance = candidate;
    closest = &seen;
  }
  return *closest;
}

}  // namespace

Vec3 TrueScene::closestVisible(const Vec3& p, double t_s) const {
  const Surface surface = surfaceAt(t_s);
  const VisiblePatch* crossed = inFrontOf(surface.visible, p);
  return closestOf(closestPatch(surface.visible, p, crossed == nullptr ? -1 : crossed->sheet).patch, p);
}

double TrueScene::penetration(const Vec3& p, double t_s) const {
  const Surface surface = surfaceAt(t_s);
  const VisiblePatch* crossed = inFrontOf(surface.visible, p);
  if (crossed == nullptr) return 0;
  return norm(p - closestOf(closestPatch(surface.visible, p, crossed->sheet).patch, p));
}

Vec3 TrueScene::normal(const Vec3& p, double t_s) const {
  const Surface surface = surfaceAt(t_s);
  const VisiblePatch& seen = closestPatch(surface.visible, p, -1);
  return std::visit([&p](const auto& piece) { return piece.normal(piece.closest(p)); }, seen.patch);
}

TrueScene::Approach TrueScene::approach(double t_s) const {
  const double distance = distanceAt(t_s);
  switch (parameters_.kind) {
    case SceneKind::plane:
      return {{0, 0, -distance}, -normal({0, 0, -distance}, t_s)};
    case SceneKind::convex_edge:
      return {{kBesideEdge_m, 0, -distance - kBesideEdge_m}, {0, 0, -1}};
    case SceneKind::half_plane:
    case SceneKind::step:
      return {{-kBesideEdge_m, 0, -distance}, {0, 0, -1}};
    case SceneKind::sphere:
    case SceneKind::bowl:
    case SceneKind::cylinder:
    case SceneKind::inner_corner:
    case SceneKind::thin_plate:
      break;
  }
  return {{0, 0, -distance}, {0, 0, -1}};
}

double TrueScene::firstDepth(const Surface& surface, const Vec3& ray) const {
  double depth = kInfinity;
  for (const VisiblePatch& seen : surface.visible) depth = std::min(depth, depthOf(seen.patch, ray));
  return depth;
}

double TrueScene::trueDepth(int column, int row, double t_s) const {
  const double depth = firstDepth(surfaceAt(t_s), camera_.rayThrough(column, row));
  return std::isfinite(depth) ? depth : 0;
}

void TrueScene::render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame) {
  const bool measured = measured_at_s_ >= 0 && (parameters_.speed_m_per_s == 0 || measured_at_s_ == t_s);
  if (!measured) {
    camera_.measure(
        [this, surface = surfaceAt(t_s)](const Vec3& ray) { return 1 / firstDepth(surface, ray); });
    measured_at_s_ = t_s;
  }
  sensor_.deliver(camera_, frame_number, noise, frame);
  camera_.removeOutsideLimits(frame);
  frame.arrival_ns = std::llround(t_s * 1e9);
}

}  // namespace hapticd::tools
