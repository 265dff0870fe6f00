// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/arm.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace hapticd::tools::phantom_omni {
namespace {

// All fields are little-endian.
constexpr std::uint16_t kHeader = 0x0000;
constexpr std::uint16_t kSecondHeader = 0x001e;
constexpr std::size_t kEncodersAt = 4;
constexpr std::size_t kSwitchesAt = 19;  // zero: pressed, docked
constexpr std::size_t kCounterAt = 32;
constexpr int kButtons = 2;
constexpr unsigned int kUndocked = 1U << 2;

constexpr std::size_t kBitsAt = 6;
constexpr int kNoTorque = 0x7ff;
constexpr std::uint16_t kBaseBits = 0x53c0;  // everything off; the meaning of most is not known
constexpr std::uint16_t kMotorsOn = 1U << 3;

std::uint16_t wordAt(std::span<const unsigned char> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

}  // namespace

std::optional<OmniReading> readingIn(std::span<const unsigned char> bytes) {
  if (bytes.size() < kReadingBytes) return std::nullopt;
  if (wordAt(bytes, 0) != kHeader || wordAt(bytes, 2) != kSecondHeader) return std::nullopt;
  OmniReading reading;
  for (std::size_t joint = 0; joint < reading.encoders.size(); ++joint)
    reading.encoders[joint] = static_cast<std::int16_t>(wordAt(bytes, kEncodersAt + 2 * joint));
  const unsigned int switches = bytes[kSwitchesAt];
  reading.buttons = ~switches & ((1U << kButtons) - 1);
  reading.docked = (switches & kUndocked) == 0;
  reading.counter = wordAt(bytes, kCounterAt) | std::uint32_t{wordAt(bytes, kCounterAt + 2)} << 16;
  return reading;
}

std::array<unsigned char, kCommandBytes> bytesOf(const OmniCommand& command) {
  std::array<unsigned char, kCommandBytes> bytes{};
  const auto write = [&bytes](std::size_t at, unsigned int word) {
    bytes[at] = static_cast<unsigned char>(word);
    bytes[at + 1] = static_cast<unsigned char>(word >> 8);
  };
  for (std::size_t joint = 0; joint < command.counts.size(); ++joint) {
    const int counts = command.motors_on ? std::clamp(command.counts[joint], -kMostCounts, kMostCounts) : 0;
    write(2 * joint, static_cast<unsigned int>(kNoTorque + counts));
  }
  write(kBitsAt, kBaseBits | static_cast<unsigned int>(command.light) | (command.motors_on ? kMotorsOn : 0U));
  return bytes;
}

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

OmniCommand commandFor(const PerJoint<double>& angles_rad, const PerJoint<double>& n_m_per_count,
                       const rt::Vec3& force_n) {
  PerJoint<double> counts = jointTorques(angles_rad, force_n);
  double most = 0;
  for (std::size_t joint = 0; joint < counts.size(); ++joint) {
    counts[joint] /= n_m_per_count[joint];
    most = std::max(most, std::abs(counts[joint]));
  }
  const double share = most > kMostCounts ? kMostCounts / most : 1;
  OmniCommand command{.counts = {}, .motors_on = true, .light = {}};
  for (std::size_t joint = 0; joint < counts.size(); ++joint)
    command.counts[joint] = static_cast<int>(std::lround(share * counts[joint]));
  return command;
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
