// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/body_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kNotMet = std::numeric_limits<double>::infinity();

/// A ray from the camera in the bodies' frame; its parameter is the depth Z.
struct BodyRays {
  Vec3 camera_m;
  Vec3 right;
  Vec3 up;
  Vec3 ahead;

  explicit BodyRays(const RigidFrame& bodies)
      : camera_m(bodies.positionIn({})),
        right(bodies.directionIn({1, 0, 0})),
        up(bodies.directionIn({0, 1, 0})),
        ahead(bodies.directionIn({0, 0, -1})) {}
  /// `ray`: in the camera's frame, at depth 1.
  Vec3 direction(const Vec3& ray) const { return ray.x * right + ray.y * up + ahead; }
};

double firstDepth(const std::vector<TrueBody>& bodies, const Vec3& origin, const Vec3& direction) {
  double depth = kNotMet;
  for (const TrueBody& body : bodies) {
    depth = std::min(depth,
                     std::visit([&](const auto& solid) { return solid.rayEntry(origin, direction); }, body));
  }
  return depth;
}

}  // namespace

double Beat::displacement_m(double elapsed_s) const {
  double displacement_m = 0;
  for (std::size_t i = 0; i < amplitudes_m.size(); ++i) {
    const double harmonic = static_cast<double>(i + 1);
    const double sign = i % 2 == 0 ? -1 : 1;
    displacement_m +=
        sign * amplitudes_m[i] * (std::cos(2 * std::numbers::pi * harmonic * hz * elapsed_s) - 1);
  }
  return displacement_m;
}

bool BodyMotion::rests() const {
  const Vec3 none{};
  return beat.rests() && velocity_m_per_s == none && turning_rad_per_s == none && sway_m == none &&
         sway_rad == none;
}

RigidFrame BodyMotion::at(const RigidFrame& rested, double t_s) const {
  const double elapsed = std::max(0.0, t_s - start_s);
  const double phase = 2 * std::numbers::pi * sway_hz * elapsed;
  const Vec3 sway{std::sin(phase), std::sin(1.1 * phase), std::sin(1.2 * phase)};
  const auto swayed = [&sway](const Vec3& amplitude) {
    return Vec3{amplitude.x * sway.x, amplitude.y * sway.y, amplitude.z * sway.z};
  };
  return rested.moved(
      elapsed * turning_rad_per_s + swayed(sway_rad),
      elapsed * velocity_m_per_s + swayed(sway_m) + beat.displacement_m(elapsed) * beat.direction);
}

BodyScene::BodyScene(std::vector<TrueBody> bodies, const RigidFrame& T_camera_bodies,
                     const BodyMotion& motion, const rt::DepthModelParameters& depth_model,
                     std::uint32_t seed)
    : bodies_(std::move(bodies)),
      T_camera_bodies_(T_camera_bodies),
      motion_(motion),
      camera_(depth_model),
      sensor_(seed) {}

double BodyScene::signedDistance(const Vec3& p, double t_s) const {
  const Vec3 inside = frameAt(t_s).positionIn(p);
  double distance = kNotMet;
  for (const TrueBody& body : bodies_) {
    distance = std::min(
        distance, std::visit([&inside](const auto& solid) { return solid.signedDistance(inside); }, body));
  }
  return distance;
}

double BodyScene::trueDepth(double column, double row, double t_s) const {
  const BodyRays rays(frameAt(t_s));
  return firstDepth(bodies_, rays.camera_m, rays.direction(camera_.rayThrough(column, row)));
}

void BodyScene::render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame) {
  if (!measured_at_s_ || (!rests() && *measured_at_s_ != t_s)) {
    const BodyRays rays(frameAt(t_s));
    camera_.measure(
        [&](const Vec3& ray) { return 1 / firstDepth(bodies_, rays.camera_m, rays.direction(ray)); });
    measured_at_s_ = t_s;
  }
  sensor_.deliver(camera_, frame_number, noise, frame);
  camera_.removeOutsideLimits(frame);
  frame.arrival_ns = std::llround(t_s * 1e9);
}

std::optional<Hold> IdealConstraint::follow(const Vec3& hip, double t_s) {
  const RigidFrame frame = scene_.frameAt(t_s);
  const Vec3 inside = frame.positionIn(hip);
  const Vec3 before = before_m_.value_or(inside);
  before_m_ = inside;
  std::optional<Hold> held;
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    const auto by_body = std::visit([&](const auto& solid) { return solid.hold(inside, before, sides_[i]); },
                                    scene_.bodies()[i]);
    if (by_body) held = Hold{frame.positionOut(by_body->proxy_m), frame.directionOut(by_body->outward)};
  }
  return held;
}

}  // namespace hapticd::tools
