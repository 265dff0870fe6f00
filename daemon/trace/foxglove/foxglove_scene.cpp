// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/foxglove/foxglove_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "daemon/trace/foxglove/foxglove_messages.h"
#include "rt/laws/law_table.h"

namespace hapticd::trace {
namespace {

/// Pixels from first to last, not including the last.
struct Range {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};

/// Returns the depth along the optical axis, or 0 if the raw value stands for no point.
double depthOf(const rt::DepthFrameHeader& header, std::uint32_t raw) {
  const auto& [scale, offset] = header.depth_law_coefficients;
  const double value = scale * raw + offset;
  const double depth_m = header.depth_law == rt::DepthLawKind::reciprocal ? 1 / value : value;
  const bool measured =
      raw != header.raw_no_measurement && depth_m > 0 && depth_m <= DepthPoints::kFarthest_m;
  return measured ? depth_m : 0;
}

std::uint16_t rawAt(std::span<const std::byte> row, std::uint32_t column) {
  std::uint16_t raw = 0;
  std::memcpy(&raw, row.data() + column * sizeof raw, sizeof raw);
  return raw;
}

/// Returns the pixels along one axis of the image that can show points between `low_m` and `high_m` on that
/// axis of the camera, at depths from `near_m` on.
Range pixelsBetween(double low_m, double high_m, double near_m, double far_m, double centre_px, double f_px,
                    std::uint32_t size_px) {
  if (!(near_m > 0)) return {0, size_px};
  const double low_px = centre_px + f_px * std::min(low_m / near_m, low_m / far_m);
  const double high_px = centre_px + f_px * std::max(high_m / near_m, high_m / far_m);
  const double most_px = size_px;
  const auto first = static_cast<std::uint32_t>(std::clamp(std::floor(low_px), 0.0, most_px));
  const auto last = static_cast<std::uint32_t>(std::clamp(std::ceil(high_px) + 1, 0.0, most_px));
  return {first, last};
}

/// Returns the centre of a ball in the camera frame.
rt::Vec3 inCamera(const rt::DepthFrameHeader& header, const rt::Vec3& point_m_in_world) {
  const auto& r = header.rotation_world_camera;
  const auto& [x_m, y_m, z_m] = header.position_m_in_world;
  const rt::Vec3 d = point_m_in_world - rt::Vec3{x_m, y_m, z_m};
  return {r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z,
          r[2] * d.x + r[5] * d.y + r[8] * d.z};
}

}  // namespace

void DepthPoints::updateTable(const rt::DepthFrameHeader& header) {
  const bool same = !depth_m_.empty() && table_of_.depth_law == header.depth_law &&
                    table_of_.depth_law_coefficients == header.depth_law_coefficients &&
                    table_of_.raw_no_measurement == header.raw_no_measurement;
  if (same) return;
  table_of_ = header;
  depth_m_.resize(std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1);
  for (std::uint32_t raw = 0; raw < depth_m_.size(); ++raw) depth_m_[raw] = depthOf(header, raw);
}

std::span<const float> DepthPoints::decimated(const rt::DepthFrameHeader& header,
                                              std::span<const std::byte> image, std::uint32_t step) {
  updateTable(header);
  points_.clear();
  for (std::uint32_t row = 0; row < header.height_px; row += step) {
    const auto pixels = image.subspan(std::size_t{row} * header.stride_bytes, header.stride_bytes);
    const double y_of_z = (row - header.cy_px) / header.fy_px;
    for (std::uint32_t column = 0; column < header.width_px; column += step) {
      const double depth_m = depth_m_[rawAt(pixels, column)];
      if (depth_m == 0) continue;
      const double x_of_z = (column - header.cx_px) / header.fx_px;
      points_.push_back(static_cast<float>(depth_m * x_of_z));
      points_.push_back(static_cast<float>(-depth_m * y_of_z));
      points_.push_back(static_cast<float>(-depth_m));
    }
  }
  return points_;
}

std::span<const float> DepthPoints::inBall(const rt::DepthFrameHeader& header,
                                           std::span<const std::byte> image, const ModelledBall& ball) {
  updateTable(header);
  points_.clear();
  const rt::Vec3 centre = inCamera(header, ball.centre_m_in_world);
  const double r = ball.radius_m;
  const double near_m = -centre.z - r, far_m = -centre.z + r;
  if (!rt::isFinite(centre) || !(r > 0) || !(far_m > 0)) return points_;
  const Range columns =
      pixelsBetween(centre.x - r, centre.x + r, near_m, far_m, header.cx_px, header.fx_px, header.width_px);
  const Range rows = pixelsBetween(-centre.y - r, -centre.y + r, near_m, far_m, header.cy_px, header.fy_px,
                                   header.height_px);
  for (std::uint32_t row = rows.first; row < rows.last; ++row) {
    const auto pixels = image.subspan(std::size_t{row} * header.stride_bytes, header.stride_bytes);
    const double y_of_z = (row - header.cy_px) / header.fy_px;
    for (std::uint32_t column = columns.first; column < columns.last; ++column) {
      const double depth_m = depth_m_[rawAt(pixels, column)];
      if (depth_m == 0 || depth_m < near_m || depth_m > far_m) continue;
      const double x_of_z = (column - header.cx_px) / header.fx_px;
      const rt::Vec3 point{depth_m * x_of_z, -depth_m * y_of_z, -depth_m};
      const rt::Vec3 apart = point - centre;
      if (rt::dot(apart, apart) > r * r) continue;
      for (const double component : {point.x, point.y, point.z}) {
        points_.push_back(static_cast<float>(component));
      }
    }
  }
  return points_;
}

}  // namespace hapticd::trace

namespace hapticd::trace::foxglove {
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
                .rotation = rt::quaternionOf(camera.rotation_world_camera)},
      Transform{.parent = kCameraFrame, .child = kOpticalFrame, .rotation = {1, 0, 0, 0}}};
  encodeTransforms(realtime_ns, transforms, to);
}

}  // namespace hapticd::trace::foxglove
