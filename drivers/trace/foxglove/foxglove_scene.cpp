// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/foxglove/foxglove_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "drivers/trace/foxglove/foxglove_messages.h"
#include "drivers/trace/foxglove/foxglove_schemas.h"
#include "rt/laws/law_table.h"

namespace hapticd::drivers::foxglove {
namespace {

constexpr Color kHip{0.95, 0.55, 0.1, 0.5};
constexpr Color kProxy{0.2, 0.5, 0.9, 0.9};
constexpr Color kForce{0.85, 0.15, 0.15, 1};
constexpr Color kReach{0.6, 0.6, 0.6, 0.12};

/// A smaller force has no arrow.
constexpr double kMinForce_n = 0.01;
/// The modelled part is drawn only where it is a ball around the hand.
constexpr double kMaxReach_m = 2;

Entity hipOf(const rt::Tick& tick, const SceneRadii& radii) {
  Entity hip{.id = "hip"};
  const double radius_m = rt::hasProxy(tick.law) ? radii.proxy_m : radii.springs_m;
  if (rt::isFinite(tick.hip_m_in_world)) hip.spheres.push_back({tick.hip_m_in_world, radius_m, kHip});
  return hip;
}

Entity proxyOf(const rt::Tick& tick, const SceneRadii& radii) {
  Entity proxy{.id = "proxy"};
  if (rt::hasProxy(tick.law) && rt::isFinite(tick.proxy_m_in_world)) {
    proxy.spheres.push_back({tick.proxy_m_in_world, radii.proxy_m, kProxy});
  }
  return proxy;
}

Entity forceOf(const rt::Tick& tick) {
  Entity force{.id = "force"};
  const rt::Vec3& force_n = tick.command_force_n_in_world;
  const double size_n = rt::norm(force_n);
  if (!std::isfinite(size_n) || size_n < kMinForce_n || !rt::isFinite(tick.hip_m_in_world)) return force;
  constexpr double kShaft_m = 0.004, kHead_m = 0.01, kHeadLength_m = 0.015, kText_px = 14;
  const rt::Vec3 to_tip_m = kArrow_m_per_n * force_n;
  force.arrows.push_back({.tail_m = tick.hip_m_in_world,
                          .tail_to_tip_m = to_tip_m,
                          .shaft_diameter_m = kShaft_m,
                          .head_diameter_m = kHead_m,
                          .head_length_m = std::min(kHeadLength_m, kArrow_m_per_n * size_n),
                          .color = kForce});
  force.labels.push_back({.position_m = tick.hip_m_in_world + to_tip_m,
                          .height_px = kText_px,
                          .color = kForce,
                          .text = fmt::format("{:.2f} N", size_n)});
  return force;
}

Entity reachOf(const ModelledBall& ball) {
  Entity reach{.id = "reach"};
  const bool drawn =
      ball.radius_m > 0 && ball.radius_m <= kMaxReach_m && rt::isFinite(ball.centre_m_in_world);
  if (drawn) reach.spheres.push_back({ball.centre_m_in_world, ball.radius_m, kReach});
  return reach;
}

}  // namespace

void SceneRadii::set(std::string_view name, double value) {
  if (name == "force.radius_m") springs_m = value;
  if (name == "contact.proxy_radius_m") proxy_m = value;
}

void SceneRadii::set(std::string_view name, std::string_view value) {
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error == std::errc() && end == value.data() + value.size()) set(name, number);
}

void encodeScene(std::uint64_t realtime_ns, const rt::Tick& tick, const SceneRadii& radii,
                 const ModelledBall& ball, std::string& to) {
  const std::array<Entity, 4> entities{hipOf(tick, radii), proxyOf(tick, radii), forceOf(tick),
                                       reachOf(ball)};
  encodeScene(realtime_ns, entities, to);
}

void encodeCameraTransforms(std::uint64_t realtime_ns, const rt::DepthFrameHeader& camera, std::string& to) {
  const auto& [x_m, y_m, z_m] = camera.position_m_in_world;
  const std::array<Transform, 2> transforms{
      Transform{.parent = kWorldFrame,
                .child = kCameraFrame,
                .translation_m = {x_m, y_m, z_m},
                .rotation = quaternionOf(camera.rotation_world_camera)},
      Transform{.parent = kCameraFrame, .child = kOpticalFrame, .rotation = {1, 0, 0, 0}}};
  encodeTransforms(realtime_ns, transforms, to);
}

}  // namespace hapticd::drivers::foxglove
