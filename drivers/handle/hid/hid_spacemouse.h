// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "config/settings/settings.h"
#include "drivers/handle/handle_frame.h"
#include "rt/base/vec3.h"

namespace hapticd::drivers {

/// State of a SpaceMouse's cap; each value stays valid until a report changes it.
struct SpaceMouseState {
  /// x right, y towards the user, z down; +-350, on older devices +-500.
  std::array<std::int16_t, 3> translation{};
  std::array<std::int16_t, 3> rotation{};
  std::uint32_t buttons = 0;
};

/// Processes an input report, which begins with its id: 1 translation, or all six axes; 2 rotation; 3
/// buttons. Others (such as the battery state) are ignored. Returns false for a report with one of these ids
/// that has a wrong length or an impossible deflection.
/// RT: safe.
bool takeOver(SpaceMouseState& state, std::span<const std::uint8_t> report);

/// A position moved by a SpaceMouse: its deflection is a velocity, which is integrated starting from the
/// origin. Axes are those of the world (x right, y up, z towards the user); the cap's own have y towards the
/// user and z down.
/// Thread: one.  RT: safe.
class SpaceMouseMotion {
 public:
  /// Deflection at the end of an axis, in counts.
  static constexpr int kFullDeflection = 350;
  /// Largest deflection reported by a released cap; beyond it the speed grows from zero.
  static constexpr int kDeadZone = 17;
  /// Longest time integrated in one step.
  static constexpr double kMaxStepS = 0.01;

  /// `full_speed_m_per_s`: speed at full deflection of an axis; `reach_m`: largest distance from the origin,
  /// per axis.
  SpaceMouseMotion(double full_speed_m_per_s, double reach_m)
      : full_speed_m_per_s_(full_speed_m_per_s), reach_m_(reach_m) {}

  /// Integrates over `dt_s`, limited to kMaxStepS.
  void step(const SpaceMouseState& cap, double dt_s);

  const rt::Vec3& position_m() const { return position_; }
  /// Returns the velocity; zero along an axis that is at its end.
  const rt::Vec3& velocity_m_per_s() const { return velocity_; }

 private:
  void stepAxis(double rt::Vec3::*axis, int deflection, double dt_s);

  double full_speed_m_per_s_;
  double reach_m_;
  rt::Vec3 position_;
  rt::Vec3 velocity_;
};

/// A SpaceMouse as a handle without forces; it neither waits nor reads. The HIP keeps its position when the
/// device is lost.
/// Thread: one.
class HidSpaceMouse {
 public:
  static constexpr double kReachM = 0.5;  ///< of the HIP from its origin, per axis

  HidSpaceMouse(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale);

  /// Called when the device has been opened: begins a new session with the cap released.
  void opened(std::int64_t now_ns);
  /// Processes an input report.
  void take(std::span<const std::uint8_t> report);
  /// Integrates the motion up to `now_ns` and returns the state to publish.
  rt::HandleState state(std::int64_t now_ns);

  std::uint64_t measurements() const { return measurements_; }
  std::uint64_t rejected() const { return rejected_; }

 private:
  HandleFrame frame_;
  SpaceMouseMotion motion_;
  SpaceMouseState cap_;
  std::int64_t last_ns_ = 0;
  std::uint64_t measurements_ = 0;
  std::uint64_t rejected_ = 0;
};

}  // namespace hapticd::drivers
