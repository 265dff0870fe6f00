// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/arm.h"

#include <cmath>
#include <cstdlib>
#include <numbers>

namespace hapticd::tools::phantom_omni {
namespace {

// No source states where the wrist's frame begins; this is near the middle of the workspace, and near where
// the vendor's own software has it.
constexpr double kUp_m = 0.023;
constexpr double kAway_m = 0.168;

constexpr double kRadPerCount = 2 * std::numbers::pi / 15000;
constexpr PerJoint<double> kSigns{1, -1, 1};  // of the encoders

/// Counts from one value of an encoder to another, which may have wrapped around.
int countsBetween(std::int16_t from, std::int16_t to) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(to) - static_cast<std::uint16_t>(from));
}

/// Distance of the wrist from the axis of the waist.
double reachAt(const JointAngles& angles_rad) {
  return kUpperArm_m * std::cos(angles_rad[kShoulder]) + kForearm_m * std::sin(angles_rad[kElbow]);
}

}  // namespace

rt::Vec3 wristAt(const JointAngles& angles_rad) {
  const double reach_m = reachAt(angles_rad);
  return {reach_m * std::sin(angles_rad[kWaist]),
          kUpperArm_m * std::sin(angles_rad[kShoulder]) - kForearm_m * std::cos(angles_rad[kElbow]) + kUp_m,
          reach_m * std::cos(angles_rad[kWaist]) - kAway_m};
}

PerJoint<rt::Vec3> jacobianAt(const JointAngles& angles_rad) {
  const double reach_m = reachAt(angles_rad);
  const double sine = std::sin(angles_rad[kWaist]);
  const double cosine = std::cos(angles_rad[kWaist]);
  const double upper_back_m = kUpperArm_m * std::sin(angles_rad[kShoulder]);
  const double upper_up_m = kUpperArm_m * std::cos(angles_rad[kShoulder]);
  const double fore_out_m = kForearm_m * std::cos(angles_rad[kElbow]);
  const double fore_up_m = kForearm_m * std::sin(angles_rad[kElbow]);
  return {rt::Vec3{reach_m * cosine, 0, -reach_m * sine},
          rt::Vec3{-upper_back_m * sine, upper_up_m, -upper_back_m * cosine},
          rt::Vec3{fore_out_m * sine, fore_up_m, fore_out_m * cosine}};
}

PerJoint<double> jointTorques(const JointAngles& angles_rad, const rt::Vec3& force_n) {
  const PerJoint<rt::Vec3> jacobian = jacobianAt(angles_rad);
  return {dot(jacobian[kWaist], force_n), dot(jacobian[kShoulder], force_n), dot(jacobian[kElbow], force_n)};
}

std::optional<JointAngles> Homing::anglesAt(const OmniReading& reading, std::int64_t measured_ns) {
  if (!known_) look(reading, measured_ns);
  if (!known_) return std::nullopt;
  JointAngles angles_rad = kDockedAngles_rad;
  for (std::size_t joint = 0; joint < angles_rad.size(); ++joint)
    angles_rad[joint] +=
        kSigns[joint] * kRadPerCount * countsBetween(docked_[joint], reading.encoders[joint]);
  return angles_rad;
}

void Homing::look(const OmniReading& reading, std::int64_t measured_ns) {
  constexpr int kStillCounts = 8;  // 0.2 degrees
  if (!reading.docked) return still_since_.reset();
  bool still = still_since_.has_value();
  for (std::size_t joint = 0; joint < docked_.size(); ++joint)
    still = still && std::abs(countsBetween(docked_[joint], reading.encoders[joint])) <= kStillCounts;
  if (!still) {
    docked_ = reading.encoders;
    still_since_ = measured_ns;
  }
  known_ = measured_ns - *still_since_ >= kStill_ns;
}

}  // namespace hapticd::tools::phantom_omni
