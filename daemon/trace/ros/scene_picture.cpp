// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/ros/scene_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "rt/laws/law_table.h"

namespace hapticd::trace::ros {
namespace {

constexpr Colour kHip{0.95F, 0.55F, 0.1F, 0.5F};
constexpr Colour kProxy{0.2F, 0.5F, 0.9F, 0.9F};
constexpr Colour kForce{0.85F, 0.15F, 0.15F, 1};
constexpr Colour kReach{0.6F, 0.6F, 0.6F, 0.12F};

/// A smaller force has no arrow.
constexpr double kMinForce_n = 0.01;
/// The modelled part is drawn only where it is a ball around the hand.
constexpr double kMaxReach_m = 2;

Marker ballOf(const char* name, const rt::Vec3& centre_m, double radius_m, const Colour& colour,
              bool is_shown) {
  if (!is_shown || !rt::isFinite(centre_m))
    return {.name = name, .kind = Marker::Kind::sphere, .action = Marker::Action::remove};
  const double diameter_m = 2 * radius_m;
  return {.name = name,
          .kind = Marker::Kind::sphere,
          .T_frame_marker = {centre_m, {}},
          .scale_m = {diameter_m, diameter_m, diameter_m},
          .colour = colour};
}

/// The arrow and its number.
std::array<Marker, 2> forceOf(const rt::Tick& tick) {
  constexpr double kShaft_m = 0.004, kHead_m = 0.01, kHeadLength_m = 0.015, kLetter_m = 0.01;
  Marker arrow{.name = "force", .kind = Marker::Kind::arrow, .colour = kForce};
  Marker number{.name = "force", .id = 1, .kind = Marker::Kind::text, .colour = kForce};
  const rt::Vec3& force_n = tick.command_force_n_in_world;
  const double size_n = rt::norm(force_n);
  if (!std::isfinite(size_n) || size_n < kMinForce_n || !rt::isFinite(tick.hip_m_in_world)) {
    arrow.action = number.action = Marker::Action::remove;
    return {std::move(arrow), std::move(number)};
  }
  const rt::Vec3 tip_m = tick.hip_m_in_world + kArrow_m_per_n * force_n;
  arrow.points_m = {tick.hip_m_in_world, tip_m};
  // diameters of shaft and head, and the length of the head
  arrow.scale_m = {kShaft_m, kHead_m, std::min(kHeadLength_m, kArrow_m_per_n * size_n)};
  number.T_frame_marker.position_m_in_world = tip_m;
  number.scale_m = {0, 0, kLetter_m};
  number.text = fmt::format("{:.2f} N", size_n);
  return {std::move(arrow), std::move(number)};
}

}  // namespace

std::vector<FixedFrame> cameraFrames(const std::string& prefix, const rt::RigidPose& T_world_camera) {
  const std::string camera = prefix + std::string(kCameraFrame);
  // half a turn about x: from y up and looking along -z to y down and looking along z
  return {{prefix + std::string(kWorldFrame), camera, T_world_camera},
          {camera, prefix + std::string(kOpticalFrame), {{}, {1, 0, 0, 0}}}};
}

void SceneRadii::set(std::string_view name, double value) {
  if (name == "force.radius_m") springs_m = value;
  if (name == "contact.proxy_radius_m") proxy_m = value;
}

void SceneRadii::set(std::string_view name, std::string_view value) {
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error == std::errc() && end == value.data() + value.size()) set(name, number);
}

std::vector<Marker> sceneMarkers(const rt::Tick& tick, const SceneRadii& radii, const ModelledBall& ball) {
  const bool has_proxy = rt::hasProxy(tick.law);
  const bool is_ball = ball.radius_m > 0 && ball.radius_m <= kMaxReach_m;
  auto [arrow, number] = forceOf(tick);
  return {ballOf("hip", tick.hip_m_in_world, has_proxy ? radii.proxy_m : radii.springs_m, kHip, true),
          ballOf("proxy", tick.proxy_m_in_world, radii.proxy_m, kProxy, has_proxy),
          ballOf("reach", ball.centre_m_in_world, ball.radius_m, kReach, is_ball), std::move(arrow),
          std::move(number)};
}

void encodeScene(std::uint64_t realtime_ns, const rt::Tick& tick, const SceneRadii& radii,
                 const ModelledBall& ball, std::string& to) {
  encodeMarkers({static_cast<std::int64_t>(realtime_ns), kWorldFrame}, sceneMarkers(tick, radii, ball), to);
}

void encodeCameraTransforms(std::uint64_t realtime_ns, const rt::DepthFrameHeader& camera, std::string& to) {
  const auto& [x_m, y_m, z_m] = camera.position_m_in_world;
  const rt::RigidPose pose{{x_m, y_m, z_m}, rt::quaternionOf(camera.rotation_world_camera)};
  encodeFrames(static_cast<std::int64_t>(realtime_ns), cameraFrames("", pose), to);
}

}  // namespace hapticd::trace::ros
