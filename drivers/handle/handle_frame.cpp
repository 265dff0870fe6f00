#include "drivers/handle/handle_frame.h"

#include <cmath>

namespace hapticd::drivers {
namespace {

using rt::Vec3;

/// Rows of Rz(yaw) Ry(pitch) Rx(roll).
std::array<Vec3, 3> rotationOf(const rt::PoseParameters& pose) {
  const double cr = std::cos(pose.roll_rad);
  const double sr = std::sin(pose.roll_rad);
  const double cp = std::cos(pose.pitch_rad);
  const double sp = std::sin(pose.pitch_rad);
  const double cy = std::cos(pose.yaw_rad);
  const double sy = std::sin(pose.yaw_rad);
  return {{{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
           {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
           {-sp, cp * sr, cp * cr}}};
}

}  // namespace

HandleFrame::HandleFrame(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale)
    : rows_(rotationOf(settings.pose)),
      origin_m_in_world_(settings.pose.position_m),
      motion_scale_(scale.motion_scale),
      clutch_button_(settings.clutch_button),
      velocity_(settings.resolution_m) {}

void HandleFrame::beginSession() {
  ++session_;
  velocity_.reset();
  held_hip_m_in_world_.reset();
}

Vec3 HandleFrame::toWorldAxes(const Vec3& v) const {
  return {dot(rows_[0], v), dot(rows_[1], v), dot(rows_[2], v)};
}

rt::HandleState HandleFrame::stateOf(const HandleMeasurement& measurement) {
  const Vec3 estimated = velocity_.add(measurement.position_m_in_handle, measurement.time_ns);
  const Vec3 velocity = measurement.velocity_m_per_s_in_handle.value_or(estimated);
  const Vec3 unclutched = origin_m_in_world_ + motion_scale_ * toWorldAxes(measurement.position_m_in_handle);

  rt::HandleState state;
  state.position_m_in_world = unclutched + clutch_offset_m_in_world_;
  state.velocity_m_per_s_in_world = motion_scale_ * toWorldAxes(velocity);
  state.sequence = ++sequence_;
  state.time_ns = measurement.time_ns;
  state.session = session_;
  state.buttons = measurement.buttons;
  state.delay_s = measurement.delay_s;
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
  const auto& [rx, ry, rz] = rows_;
  const Vec3& f = force_n_in_world;
  return {rx.x * f.x + ry.x * f.y + rz.x * f.z, rx.y * f.x + ry.y * f.y + rz.y * f.z,
          rx.z * f.x + ry.z * f.y + rz.z * f.z};
}

}  // namespace hapticd::drivers
