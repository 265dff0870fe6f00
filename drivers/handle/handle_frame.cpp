// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/handle_frame.h"

#include <algorithm>
#include <cmath>

#include "rt/base/pose.h"

namespace hapticd::drivers {

using rt::Vec3;

namespace {

/// A position that leaps farther is a fault of its own (handle_too_fast), and says nothing of the velocity.
constexpr double kLeap_m = 0.01;
constexpr double kFastest_m_per_s = 5;

}  // namespace

bool VelocityCheck::add(const Vec3& position_m, std::int64_t time_ns, const Vec3& claimed_m_per_s,
                        const Vec3& estimated_m_per_s) {
  const std::int64_t gap_ns = time_ns - time_ns_;
  if (!isFinite(claimed_m_per_s) || !isFinite(position_m)) return true;
  if (started_ && gap_ns <= 0) return norm(error_m_) > kTolerance_m + kTolerance_s * speed_m_per_s_;
  const double leap_m = kLeap_m + kFastest_m_per_s * static_cast<double>(gap_ns) * 1e-9;
  if (!started_ || gap_ns > kMaxGapNs || norm(position_m - position_m_) > leap_m) {
    reset();
  } else {
    const double period_s = static_cast<double>(gap_ns) * 1e-9;
    const Vec3 claimed_m = (0.5 * period_s) * (claimed_m_per_s_ + claimed_m_per_s);
    const double kept = std::exp(-period_s / kWindow_s);
    error_m_ = kept * error_m_ + (claimed_m - (position_m - position_m_));
    speed_m_per_s_ = std::max(kept * speed_m_per_s_, norm(estimated_m_per_s));
  }
  started_ = true;
  time_ns_ = time_ns;
  position_m_ = position_m;
  claimed_m_per_s_ = claimed_m_per_s;
  return norm(error_m_) > kTolerance_m + kTolerance_s * speed_m_per_s_;
}

HandleFrame::HandleFrame(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale)
    : rotation_world_handle_(rt::rotationOf(settings.pose())),
      orientation_world_handle_(rt::quaternionOf(rotation_world_handle_)),
      origin_m_in_world_(settings.pose().position_m),
      motion_scale_(scale.motion_scale),
      clutch_button_(settings.clutch_button),
      device_latency_s_(settings.device_latency_s),
      measures_latency_(settings.measure_latency),
      tracker_(settings.effectivePositionStep_m()),
      velocity_(settings.resolution_m) {}

void HandleFrame::beginSession() {
  ++session_;
  tracker_.reset();
  velocity_.reset();
  check_.reset();
  distrusted_ = false;
  held_hip_m_in_world_.reset();
}

Vec3 HandleFrame::toWorldAxes(const Vec3& v) const {
  const auto& r = rotation_world_handle_;
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}

rt::HandleState HandleFrame::stateOf(const HandleMeasurement& measurement) {
  const Vec3 position = tracker_.add(measurement.position_m_in_handle, measurement.time_ns);
  const Vec3 estimated = velocity_.add(position, measurement.time_ns);
  const auto& claimed = measurement.velocity_m_per_s_in_handle;
  const bool contradicted =
      claimed && check_.add(measurement.position_m_in_handle, measurement.time_ns, *claimed, estimated);
  distrusted_ = distrusted_ || contradicted;
  const Vec3 unclutched = origin_m_in_world_ + motion_scale_ * toWorldAxes(position);

  rt::HandleState state;
  state.position_m_in_world = unclutched + clutch_offset_m_in_world_;
  state.velocity_m_per_s_in_world = motion_scale_ * toWorldAxes(estimated);
  state.sequence = ++sequence_;
  state.time_ns = measurement.time_ns;
  state.session = session_;
  state.buttons = measurement.buttons;
  state.delay_s = measurement.delay_s + device_latency_s_;
  state.velocity_claim = contradicted  ? rt::VelocityClaim::contradicted
                         : !claimed    ? rt::VelocityClaim::none
                         : distrusted_ ? rt::VelocityClaim::distrusted
                                       : rt::VelocityClaim::consistent;
  state.command_latency_ns = measurement.command_latency_ns;
  state.damps = measurement.damps;
  if (measurement.orientation_in_handle) {
    state.has_orientation = true;
    state.orientation_in_world =
        rt::normalised(orientation_world_handle_ * *measurement.orientation_in_handle);
  }
  state.has_gripper = measurement.gripper_rad.has_value();
  state.gripper_rad = measurement.gripper_rad.value_or(0);
  state.probes = measures_latency_ && measurement.over_link;
  if (!measurement.calibrated) {
    state.condition = rt::HandleCondition::not_calibrated;
    return state;
  }
  const bool clutched = clutch_button_ >= 0 && ((measurement.buttons >> clutch_button_) & 1U) != 0;
  if (!clutched) {
    held_hip_m_in_world_.reset();
    return state;
  }
  if (!held_hip_m_in_world_) held_hip_m_in_world_ = state.position_m_in_world;
  clutch_offset_m_in_world_ = *held_hip_m_in_world_ - unclutched;
  state.position_m_in_world = *held_hip_m_in_world_;
  state.velocity_m_per_s_in_world = {};
  state.condition = rt::HandleCondition::clutched;
  return state;
}

Vec3 HandleFrame::forceInHandle(const Vec3& force_n_in_world) const {
  if (!isFinite(force_n_in_world)) return {};
  const auto& r = rotation_world_handle_;
  const Vec3& f = force_n_in_world;
  return {r[0] * f.x + r[3] * f.y + r[6] * f.z, r[1] * f.x + r[4] * f.y + r[7] * f.z,
          r[2] * f.x + r[5] * f.y + r[8] * f.z};
}

}  // namespace hapticd::drivers
