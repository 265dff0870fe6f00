// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/body_scene.h"

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
  Vec3 direction(double x, double y) const { return x * right + y * up + ahead; }
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

bool BodyMotion::rests() const {
  const Vec3 none{};
  return velocity_m_per_s == none && turning_rad_per_s == none && sway_m == none && sway_rad == none;
}

RigidFrame BodyMotion::at(const RigidFrame& rested, double t_s) const {
  const double elapsed = std::max(0.0, t_s - start_s);
  const double phase = 2 * std::numbers::pi * sway_hz * elapsed;
  const Vec3 sway{std::sin(phase), std::sin(1.1 * phase), std::sin(1.2 * phase)};
  const auto swayed = [&sway](const Vec3& amplitude) {
    return Vec3{amplitude.x * sway.x, amplitude.y * sway.y, amplitude.z * sway.z};
  };
  return rested.moved(elapsed * turning_rad_per_s + swayed(sway_rad),
                      elapsed * velocity_m_per_s + swayed(sway_m));
}

BodyScene::BodyScene(std::vector<TrueBody> bodies, const RigidFrame& T_camera_bodies,
                     const BodyMotion& motion, const rt::DepthModelParameters& depth_model,
                     std::uint32_t seed)
    : bodies_(std::move(bodies)),
      T_camera_bodies_(T_camera_bodies),
      motion_(motion),
      model_(depth_model),
      seed_(seed),
      exact_(rt::kFramePixels) {}

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
  const double x = (column - model_.cx_px) / model_.fx_px;
  const double y = -(row - model_.cy_px) / model_.fy_px;
  return firstDepth(bodies_, rays.camera_m, rays.direction(x, y));
}

/// Fills `exact_`; a scene at rest is measured once.
void BodyScene::measure(double t_s) {
  if (measured_at_s_ && (rests() || *measured_at_s_ == t_s)) return;
  const BodyRays rays(frameAt(t_s));
  float* exact = exact_.data();
  for (int row = 0; row < rt::kFrameHeight; ++row) {
    const double y = -(row - model_.cy_px) / model_.fy_px;
    for (int column = 0; column < rt::kFrameWidth; ++column) {
      const double x = (column - model_.cx_px) / model_.fx_px;
      const double depth = firstDepth(bodies_, rays.camera_m, rays.direction(x, y));
      const double disparity = (1 / depth - model_.b_per_m) / model_.a_per_m;
      const bool measured = depth >= model_.near_m && depth <= model_.far_m && disparity > -0.5 &&
                            disparity < rt::kRawNoMeasurement - 0.5;
      *exact++ = measured ? static_cast<float>(std::max(disparity, 0.0)) : drivers::kNothingSeen;
    }
  }
  measured_at_s_ = t_s;
}

/// Noise may carry a disparity beyond the camera's limits.
void BodyScene::removeOutsideLimits(std::uint16_t* raw) const {
  std::array<bool, rt::kRawValues> within{};
  for (int value = 0; value < rt::kRawNoMeasurement; ++value) {
    const double inverse_depth = model_.a_per_m * value + model_.b_per_m;
    within[static_cast<std::size_t>(value)] =
        inverse_depth > 0 && 1 / inverse_depth >= model_.near_m && 1 / inverse_depth <= model_.far_m;
  }
  for (std::size_t pixel = 0; pixel < rt::kFramePixels; ++pixel) {
    if (!within[std::min<std::size_t>(raw[pixel], rt::kRawNoMeasurement)]) raw[pixel] = rt::kRawNoMeasurement;
  }
}

const drivers::SensorNoise& BodyScene::sensorNoise(SceneNoise noise) {
  if (!sensor_noise_ || made_for_ != noise) {
    sensor_noise_.emplace(
        seed_, noise == SceneNoise::harsh ? drivers::SensorNoise::harsh() : drivers::SensorNoise::recorded());
    made_for_ = noise;
  }
  return *sensor_noise_;
}

void BodyScene::render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame) {
  measure(t_s);
  if (noise > SceneNoise::quantised) {
    sensorNoise(noise).applySensor(frame_number, exact_, frame.raw);
  } else {
    std::ranges::transform(exact_, frame.raw, [](float exact) {
      return exact >= 0 ? static_cast<std::uint16_t>(exact + 0.5F) : rt::kRawNoMeasurement;
    });
  }
  removeOutsideLimits(frame.raw);
  frame.sequence = frame_number;
  frame.arrival_ns = std::llround(t_s * 1e9);
  frame.device_ticks = 0;
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
