// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "config/settings/fixture_settings.h"
#include "rt/base/pose.h"
#include "rt/base/rotation.h"
#include "rt/fixtures/fixture.h"

namespace hapticd::config {
namespace {

using rt::Rotation;

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr Rotation kIdentity{1, 0, 0, 0, 1, 0, 0, 0, 1};

Rotation product(const Rotation& a, const Rotation& b) {
  Rotation c{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      for (std::size_t k = 0; k < 3; ++k) c[3 * row + column] += a[3 * row + k] * b[3 * k + column];
    }
  }
  return c;
}

/// Rotation of a box in its frame.
Rotation rotationOf(const rt::Vec3& angles_deg) {
  return rt::rotationOf({.position_m = {},
                         .roll_rad = angles_deg.x * kRadPerDeg,
                         .pitch_rad = angles_deg.y * kRadPerDeg,
                         .yaw_rad = angles_deg.z * kRadPerDeg});
}

rt::Vec3 unit(const rt::Vec3& direction) {
  return (1 / norm(direction)) * direction;
}

/// T_world_x of a fixture's or region's frame.
class Frame {
 public:
  /// `in_camera`: of what is defined in the camera; otherwise it is in the world, or in a frame that moves.
  Frame(bool in_camera, const rt::PoseParameters& T_world_camera) {
    if (!in_camera) return;
    rotation_ = rt::rotationOf(T_world_camera);
    position_m_ = T_world_camera.position_m;
  }

  rt::Vec3 place(const rt::Vec3& p) const { return rotated(rotation_, p) + position_m_; }
  rt::Vec3 direction(const rt::Vec3& v) const { return unit(rotated(rotation_, v)); }
  Rotation rotation(const rt::Vec3& angles_deg) const { return product(rotation_, rotationOf(angles_deg)); }

 private:
  Rotation rotation_ = kIdentity;
  rt::Vec3 position_m_;
};

void setCapsule(const Frame& frame, const rt::Vec3& from_m, const rt::Vec3& to_m, double radius_m,
                rt::Shape& shape) {
  shape.kind = rt::ShapeKind::capsule;
  shape.axis_in_world = frame.direction(to_m - from_m);
  shape.length_m = norm(to_m - from_m);
  shape.radius_m = radius_m;
}

void setBox(const Frame& frame, const rt::Vec3& size_m, const rt::Vec3& rotation_deg, rt::Shape& shape) {
  shape.kind = rt::ShapeKind::box;
  shape.half_size_m = 0.5 * size_m;
  shape.rotation = frame.rotation(rotation_deg);
}

void setSphere(double radius_m, rt::Shape& shape) {
  shape.kind = rt::ShapeKind::sphere;
  shape.radius_m = radius_m;
}

rt::Shape shapeOf(const FixtureSettings& fixture, const Frame& frame) {
  rt::Shape shape;
  shape.position_m_in_world = frame.place(fixture.position_m);
  switch (fixture.kind) {
    case rt::FixtureKind::plane:
      shape.kind = rt::ShapeKind::plane;
      shape.axis_in_world = frame.direction(fixture.normal);
      break;
    case rt::FixtureKind::box:
      setBox(frame, fixture.size_m, fixture.rotation_deg, shape);
      break;
    case rt::FixtureKind::sphere:
      setSphere(fixture.radius_m, shape);
      break;
    case rt::FixtureKind::capsule:
      setCapsule(frame, fixture.position_m, fixture.end_m, fixture.radius_m, shape);
      break;
    case rt::FixtureKind::cone:
      shape.kind = rt::ShapeKind::cone;
      shape.axis_in_world = frame.direction(fixture.axis);
      shape.half_angle_sine = std::sin(fixture.half_angle_deg * kRadPerDeg);
      shape.half_angle_cosine = std::cos(fixture.half_angle_deg * kRadPerDeg);
      break;
    case rt::FixtureKind::solid:
      shape.kind = rt::ShapeKind::box;
      shape.rotation = frame.rotation(fixture.rotation_deg);
      break;
    case rt::FixtureKind::standoff:
    case rt::FixtureKind::path:
    case rt::FixtureKind::point:
      break;
  }
  return shape;
}

rt::Shape shapeOf(const RegionSettings& region, const Frame& frame) {
  rt::Shape shape;
  if (region.place != rt::TissuePlace::shape) return shape;
  shape.position_m_in_world = frame.place(region.position_m);
  if (region.shape == rt::ShapeKind::box) {
    setBox(frame, region.size_m, region.rotation_deg, shape);
  } else if (region.shape == rt::ShapeKind::capsule) {
    setCapsule(frame, region.position_m, region.end_m, region.radius_m, shape);
  } else {
    setSphere(region.radius_m, shape);
  }
  return shape;
}

rt::Fixture converted(const FixtureSettings& fixture, const Frame& frame) {
  rt::Fixture result;
  result.kind = fixture.kind;
  result.side = fixture.side;
  result.enabled = fixture.enabled;
  result.shape = shapeOf(fixture, frame);
  result.effect = fixture.effect;
  result.clearance_m = beginning_m(fixture);
  result.soft_m = fixture.soft_m;
  result.soft_stiffness_n_per_m = fixture.soft_stiffness_n_per_m;
  result.warning_m = fixture.warning_m;
  result.breach_m = fixture.breach_m;
  result.viscosity_n_s_per_m = fixture.viscosity_n_s_per_m;
  result.speed_limit_m_per_s = fixture.speed_limit_m_per_s;
  result.ramp_m = fixture.ramp_m;
  result.stiffness_n_per_m = fixture.stiffness_n_per_m;
  result.damping_n_s_per_m = fixture.damping_n_s_per_m;
  result.deadband_m = fixture.deadband_m;
  result.max_force_n = fixture.max_force_n;
  result.fade_in_s = fixture.fade_in_s;
  result.escape_force_n = fixture.escape_force_n;
  result.fades_without_depth = effectiveOnCameraLoss(fixture) == OnCameraLoss::fade;
  return result;
}

rt::TissueRegion converted(const RegionSettings& region, const Frame& frame) {
  rt::TissueRegion result;
  result.place = region.place;
  result.shape = shapeOf(region, frame);
  result.label = static_cast<std::uint8_t>(region.label);
  result.transition_m = region.transition_m;
  result.model = region.model;
  result.stiffness_n_per_m = region.stiffness_n_per_m;
  result.exponent = region.exponent;
  result.damping_per_speed_s_per_m = region.damping_per_speed_s_per_m;
  result.lower_stiffness_n_per_m = region.lower_stiffness_n_per_m;
  result.layer_m = region.layer_m;
  result.damping_n_s_per_m = region.damping_n_s_per_m;
  result.friction = region.friction;
  result.cue_force_n = region.cue_force_n;
  result.cue_hz = region.cue_hz;
  return result;
}

/// rt::Fixture::frame; of a frame that is not in the list a place where there is none.
std::int32_t frameIndex(const FixtureSettings& fixture, const std::vector<FrameSettings>& frames) {
  if (isResting(fixture.frame)) return -1;
  const auto found = std::ranges::find(frames, fixture.frame, &FrameSettings::name);
  return static_cast<std::int32_t>(found == frames.end() ? static_cast<std::ptrdiff_t>(rt::kMaxFrames)
                                                         : found - frames.begin());
}

bool isSameDefinition(FixtureSettings a, const FixtureSettings& b) {
  a.enabled = b.enabled;
  return a == b;
}

/// Returns a number that this position in this generation of a set has alone, because generations are never
/// repeated; not 0.
template <std::size_t kCapacity>
std::uint64_t newNumber(std::uint64_t generation, std::size_t index) {
  return generation * kCapacity + index + 1;
}

/// Returns the index of a name in a list that the first `count` elements of a set were made from, or `count`.
template <typename Settings>
std::size_t indexOf(const std::string& name, const std::vector<Settings>& list, std::size_t count) {
  const auto found = std::ranges::find(list, name, &Settings::name);
  return std::min(static_cast<std::size_t>(found - list.begin()), count);
}

}  // namespace

std::uint32_t frameIdentity(std::string_view name) {
  std::uint32_t hash = 2166136261;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return std::max<std::uint32_t>(hash, 1);
}

rt::FrameRules rulesOf(const FrameSettings& frame) {
  return {.identity = frameIdentity(frame.name),
          .on_loss = frame.on_loss,
          .timeout_s = frame.timeout_s,
          .keepalive = frame.keepalive,
          .max_speed_m_per_s = frame.max_speed_m_per_s};
}

OnCameraLoss effectiveOnCameraLoss(const FixtureSettings& fixture) {
  if (fixture.on_camera_loss != OnCameraLoss::automatic) return fixture.on_camera_loss;
  return fixture.kind == rt::FixtureKind::standoff ? OnCameraLoss::fade : OnCameraLoss::keep;
}

rt::Vec3 rotationOf(const Quaternion& orientation) {
  const auto [x, y, z, w] = orientation;
  const Rotation r{1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                   2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                   2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
  const double yaw = std::atan2(r[3], r[0]);
  const double pitch = std::atan2(-r[6], std::hypot(r[0], r[3]));
  // What is left when the yaw is undone: exact also where a pitch of 90 degrees leaves the yaw undefined.
  const double sine = std::sin(yaw);
  const double cosine = std::cos(yaw);
  const double roll = std::atan2(sine * r[2] - cosine * r[5], cosine * r[4] - sine * r[1]);
  return (1 / kRadPerDeg) * rt::Vec3{roll, pitch, yaw};
}

Quaternion orientationOf(const rt::Vec3& rotation_deg) {
  const rt::Vec3 half = (kRadPerDeg / 2) * rotation_deg;
  const double sr = std::sin(half.x);
  const double cr = std::cos(half.x);
  const double sp = std::sin(half.y);
  const double cp = std::cos(half.y);
  const double sy = std::sin(half.z);
  const double cy = std::cos(half.z);
  return {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
          cr * cp * cy + sr * sp * sy};
}

void toFixtureSet(const std::vector<FixtureSettings>& fixtures, const std::vector<FixtureSettings>& before,
                  const FixtureSurroundings& surroundings, rt::FixtureSet& set) {
  const auto& [T_world_camera, frames, solids, tool_radius_m] = surroundings;
  const auto old = set.fixtures;
  const std::size_t old_count = std::min<std::size_t>(set.count, before.size());
  ++set.generation;
  set.fixtures = {};
  set.count = static_cast<std::uint32_t>(std::min(fixtures.size(), rt::kMaxFixtures));
  set.frames = {};
  set.frame_count = static_cast<std::uint32_t>(std::min(frames.size(), rt::kMaxFrames));
  std::transform(frames.begin(), frames.begin() + set.frame_count, set.frames.begin(), rulesOf);
  std::size_t used = 0;
  for (std::size_t i = 0; i < set.count; ++i) {
    const Frame frame(fixtures[i].frame == "camera", T_world_camera);
    rt::Fixture& fixture = set.fixtures[i];
    fixture = converted(fixtures[i], frame);
    if (!isGuidance(fixture.kind)) fixture.clearance_m += tool_radius_m;
    fixture.frame = frameIndex(fixtures[i], frames);
    fixture.definition = newNumber<rt::kMaxFixtures>(set.generation, i);
    fixture.identity = static_cast<std::uint32_t>(fixture.definition);
    if (const std::size_t j = indexOf(fixtures[i].name, before, old_count); j < old_count) {
      fixture.identity = old[j].identity;
      const bool same_tool = fixture.clearance_m == old[j].clearance_m;
      if (same_tool && isSameDefinition(fixtures[i], before[j])) fixture.definition = old[j].definition;
    }
    if (fixtures[i].kind == rt::FixtureKind::solid) {
      const auto solid = solids.find(fixtures[i].solid);
      if (solid != solids.end()) fixture.grid = solid->second->grid();
      fixture.enabled = fixture.enabled && solid != solids.end();
    }
    if (fixtures[i].kind != rt::FixtureKind::path) continue;
    std::vector<rt::Vec3> points_m_in_world;
    for (const rt::Vec3& point : fixtures[i].points_m) points_m_in_world.push_back(frame.place(point));
    fixture.first_element = static_cast<std::uint32_t>(used);
    const std::size_t count =
        rt::smoothPath(points_m_in_world, fixtures[i].bend_radius_m, std::span(set.elements).subspan(used));
    fixture.element_count = static_cast<std::uint32_t>(count);
    used += count;
  }
}

void toTissueMap(const std::vector<RegionSettings>& regions, const std::vector<RegionSettings>& before,
                 const LabelImage& image, const rt::PoseParameters& T_world_camera, rt::TissueMap& map) {
  const auto old = map.regions;
  const std::size_t old_count = std::min<std::size_t>(map.count, before.size());
  ++map.generation;
  map.regions = {};
  map.count = static_cast<std::uint32_t>(std::min(regions.size(), rt::kMaxTissueRegions));
  for (std::size_t i = 0; i < map.count; ++i) {
    rt::TissueRegion& region = map.regions[i];
    region = converted(regions[i], Frame(regions[i].frame == FixtureFrame::camera, T_world_camera));
    region.identity = static_cast<std::uint32_t>(newNumber<rt::kMaxTissueRegions>(map.generation, i));
    const std::size_t j = indexOf(regions[i].name, before, old_count);
    if (j < old_count) region.identity = old[j].identity;
  }
  map.has_labels = !image.labels.empty();
  map.label_width_px = image.width_px;
  map.label_height_px = image.height_px;
  map.labels.fill(0);
  std::ranges::transform(image.labels, map.labels.begin(),
                         [](char label) { return static_cast<std::uint8_t>(label); });
}

}  // namespace hapticd::config
