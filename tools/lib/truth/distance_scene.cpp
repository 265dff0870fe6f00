// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/distance_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "rt/fixtures/standoff.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kNoSurface = std::numeric_limits<double>::infinity();

/// Where several places are as near, any of them.
NearestSurface awayFrom(const Vec3& place, const Vec3& p, double radius) {
  const double distance = norm(p - place);
  return {distance - radius, distance > 0 ? (1 / distance) * (p - place) : Vec3{0, 0, 1}};
}

/// A box by how far a place in the first octant is beyond each of its faces.
NearestSurface boxAt(const Vec3& beyond) {
  const Vec3 outside{std::max(beyond.x, 0.0), std::max(beyond.y, 0.0), std::max(beyond.z, 0.0)};
  const double distance = norm(outside);
  if (distance > 0) return {distance, (1 / distance) * outside};
  if (beyond.x >= beyond.y && beyond.x >= beyond.z) return {beyond.x, {1, 0, 0}};
  return beyond.y >= beyond.z ? NearestSurface{beyond.y, {0, 1, 0}} : NearestSurface{beyond.z, {0, 0, 1}};
}

NearestSurface nearestOf(const PlaneShape&, const Vec3& p) {
  return {p.z, {0, 0, 1}};
}
NearestSurface nearestOf(const BallShape& ball, const Vec3& p) {
  return awayFrom({}, p, ball.radius_m);
}
NearestSurface nearestOf(const CapsuleShape& rod, const Vec3& p) {
  return awayFrom({std::clamp(p.x, -rod.half_length_m, rod.half_length_m), 0, 0}, p, rod.radius_m);
}
NearestSurface nearestOf(const BoxShape& box, const Vec3& p) {
  const NearestSurface n = boxAt(Vec3{std::abs(p.x), std::abs(p.y), std::abs(p.z)} - box.half_m);
  return {
      n.distance_m,
      {std::copysign(n.outward.x, p.x), std::copysign(n.outward.y, p.y), std::copysign(n.outward.z, p.z)}};
}
NearestSurface nearestOf(const RingShape& ring, const Vec3& p) {
  const double from_axis = std::hypot(p.x, p.y);
  const double from_middle = from_axis - (ring.inner_m + ring.outer_m) / 2;
  const Vec3 radial = from_axis > 0 ? (1 / from_axis) * Vec3{p.x, p.y, 0} : Vec3{1, 0, 0};
  const NearestSurface n = boxAt({std::abs(from_middle) - (ring.outer_m - ring.inner_m) / 2, -kNoSurface,
                                  std::abs(p.z) - ring.half_thickness_m});
  return {n.distance_m,
          std::copysign(n.outward.x, from_middle) * radial + Vec3{0, 0, std::copysign(n.outward.z, p.z)}};
}
NearestSurface nearestOf(const BowlShape& bowl, const Vec3& p) {
  const double from_axis = std::hypot(p.x, p.y);
  if (p.z > 0 && from_axis < bowl.radius_m) {
    const Vec3 radial = from_axis > 0 ? (1 / from_axis) * Vec3{p.x, p.y, 0} : Vec3{1, 0, 0};
    return awayFrom(bowl.radius_m * radial, p, 0);
  }
  const NearestSurface ball = awayFrom({}, p, bowl.radius_m);
  return p.z >= -ball.distance_m ? NearestSurface{p.z, {0, 0, 1}}
                                 : NearestSurface{-ball.distance_m, -ball.outward};
}

/// The stretch of a ray that may meet a shape.
struct RayStretch {
  double first = 0;
  double last = kNoSurface;
};
RayStretch withinBall(double radius, const Vec3& origin, const Vec3& direction) {
  const double middle = -dot(origin, direction);
  const double square = radius * radius - dot(origin, origin) + middle * middle;
  if (square < 0) return {kNoSurface, -kNoSurface};
  return {std::max(0.0, middle - std::sqrt(square)), middle + std::sqrt(square)};
}
RayStretch belowPlane(const Vec3& origin, const Vec3& direction) {
  if (origin.z <= 0) return {};
  return {direction.z < 0 ? -origin.z / direction.z : kNoSurface, kNoSurface};
}
RayStretch stretchOf(const PlaneShape&, const Vec3& origin, const Vec3& direction) {
  return belowPlane(origin, direction);
}
RayStretch stretchOf(const BowlShape&, const Vec3& origin, const Vec3& direction) {
  return belowPlane(origin, direction);
}
RayStretch stretchOf(const BallShape& ball, const Vec3& origin, const Vec3& direction) {
  return withinBall(ball.radius_m, origin, direction);
}
RayStretch stretchOf(const CapsuleShape& rod, const Vec3& origin, const Vec3& direction) {
  return withinBall(rod.radius_m + rod.half_length_m, origin, direction);
}
RayStretch stretchOf(const BoxShape& box, const Vec3& origin, const Vec3& direction) {
  return withinBall(norm(box.half_m), origin, direction);
}
RayStretch stretchOf(const RingShape& ring, const Vec3& origin, const Vec3& direction) {
  return withinBall(std::hypot(ring.outer_m, ring.half_thickness_m), origin, direction);
}

/// Sphere tracing (Hart 1996): metres along the unit vector `direction` to the shape.
template <typename Shape>
double traced(const Shape& shape, const Vec3& origin, const Vec3& direction) {
  constexpr double kMet_m = 1e-7;
  constexpr int kMaxSteps = 400;
  const RayStretch stretch = stretchOf(shape, origin, direction);
  double along = stretch.first;
  for (int step = 0; step < kMaxSteps && along <= stretch.last; ++step) {
    const double distance = nearestOf(shape, origin + along * direction).distance_m;
    if (distance < kMet_m) return along;
    along += distance;
  }
  return kNoSurface;
}

RigidFrame frameAt(const DistanceBody& body, double t_s) {
  RigidFrame frame = body.frame;
  frame.origin_m += t_s * body.velocity_m_per_s;
  return frame;
}

}  // namespace

NearestSurface DistanceBody::nearest(const Vec3& p, double t_s) const {
  const RigidFrame now = frameAt(*this, t_s);
  const Vec3 inside = now.positionIn(p);
  NearestSurface n = std::visit([&inside](const auto& solid) { return nearestOf(solid, inside); }, shape);
  n.outward = now.directionOut(n.outward);
  return n;
}

DistanceScene::DistanceScene(std::vector<DistanceBody> bodies, std::vector<ImageGap> gaps,
                             const rt::DepthModelParameters& depth_model, std::uint32_t seed)
    : bodies_(std::move(bodies)),
      gaps_(std::move(gaps)),
      rests_(std::ranges::all_of(bodies_, [](const auto& body) { return body.velocity_m_per_s == Vec3{}; })),
      camera_(depth_model),
      sensor_(seed) {}

NearestSurface DistanceScene::nearest(const Vec3& p, double t_s) const {
  NearestSurface nearest{kNoSurface, {0, 0, 1}};
  for (const DistanceBody& body : bodies_) {
    const NearestSurface of_body = body.nearest(p, t_s);
    if (of_body.distance_m < nearest.distance_m) nearest = of_body;
  }
  return nearest;
}

double DistanceScene::trueDepth(const Vec3& ray, double t_s) const {
  const double length = norm(ray);
  double depth = kNoSurface;
  for (const DistanceBody& body : bodies_) {
    const RigidFrame frame = frameAt(body, t_s);
    const Vec3 origin = frame.positionIn({});
    const Vec3 direction = frame.directionIn((1 / length) * ray);
    depth = std::min(
        depth,
        std::visit([&](const auto& solid) { return traced(solid, origin, direction); }, body.shape) / length);
  }
  return depth;
}

double DistanceScene::behindSight_m(const Vec3& p, double t_s) const {
  return -p.z - trueDepth((-1 / p.z) * p, t_s);
}

void DistanceScene::render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame) {
  if (!measured_at_s_ || (!rests_ && *measured_at_s_ != t_s)) {
    camera_.measure([&](const Vec3& ray) { return 1 / trueDepth(ray, t_s); });
    const int width = camera_.model().width_px;
    const int height = camera_.model().height_px;
    for (const ImageGap& gap : gaps_) {
      const auto clamped = [](double pixel, int size) {
        return static_cast<int>(std::clamp(std::ceil(pixel), 0.0, static_cast<double>(size)));
      };
      const int first = clamped(gap.first_column, width);
      const int count = clamped(gap.last_column, width) - first;
      for (int row = clamped(gap.first_row, height); row < clamped(gap.last_row, height); ++row)
        std::fill_n(camera_.exact().begin() + row * width + first, std::max(count, 0), drivers::kNothingSeen);
    }
    measured_at_s_ = t_s;
  }
  sensor_.deliver(camera_, frame_number, noise, frame);
  camera_.removeOutsideLimits(frame);
  frame.arrival_ns = std::llround(t_s * 1e9);
}

namespace {

constexpr double kMaxStep_m = 2e-4;
constexpr double kArrived_m = 1e-9;

}  // namespace

Vec3 GodObject::movedOut(Vec3 place, double t_s) const {
  constexpr int kRounds = 20;  // out of one body may be into another one
  for (int round = 0; round < kRounds; ++round) {
    const NearestSurface nearest = scene_.nearest(place, t_s);
    if (nearest.distance_m >= 0) break;
    place += -nearest.distance_m * nearest.outward;
  }
  return place;
}

Vec3 GodObject::target(const Vec3& hip, double t_s) const {
  constexpr std::size_t kMostBodies = 16;
  std::array<rt::HalfSpace, kMostBodies> planes;
  std::array<double, kMostBodies> multipliers{};
  std::size_t count = 0;
  for (const DistanceBody& body : scene_.bodies()) {
    const NearestSurface nearest = body.nearest(*proxy_m_, t_s);
    if (nearest.distance_m > 2 * kMaxStep_m || count == kMostBodies) continue;
    // the proxy itself is always allowed, so that there is a place that all of them allow
    const double offset = dot(nearest.outward, *proxy_m_) - std::max(nearest.distance_m, 0.0);
    planes[count++] = {nearest.outward, offset};
  }
  Vec3 place;
  const bool found = projectOnto({planes.data(), count}, hip, place, {multipliers.data(), count});
  return found ? place : *proxy_m_;
}

Vec3 GodObject::follow(const Vec3& hip, double t_s) {
  constexpr int kMaxSteps = 2000;
  if (!proxy_m_) proxy_m_ = hip;
  proxy_m_ = movedOut(*proxy_m_, t_s);
  for (int step = 0; step < kMaxSteps; ++step) {
    const Vec3 way = target(hip, t_s) - *proxy_m_;
    const double length = norm(way);
    if (length < kArrived_m) break;
    const Vec3 next = movedOut(*proxy_m_ + std::min(1.0, kMaxStep_m / length) * way, t_s);
    if (norm(next - hip) >= norm(*proxy_m_ - hip)) break;
    proxy_m_ = next;
  }
  return *proxy_m_;
}

}  // namespace hapticd::tools
