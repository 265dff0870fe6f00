// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "config/settings/settings.h"
#include "drivers/handle/velocity_estimator.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "rt/channels/handle_channel.h"

namespace hapticd::drivers {

/// Compares the velocity that a device claims with the displacement of its position. A velocity in another
/// unit, of the other sign, stuck, or noisy is contradicted after some 10 ms of motion, or at once where it
/// claims motion at rest.
///
/// The claimed displacement less the measured one, summed up over about kWindow_s, is the error. A device
/// that filters its velocity with a delay d is off by up to d times its speed, and one whose velocity is
/// scaled by 1 + s by s kWindow_s times its speed. So the velocity is contradicted where the error exceeds
/// kTolerance_m and kTolerance_s times the largest speed of the last while: filters of up to 20 ms and scales
/// within 20 % pass. Thread: one.  Progress: wait-free.  RT: safe.
class VelocityCheck {
 public:
  static constexpr double kWindow_s = 0.1;
  static constexpr double kTolerance_m = 0.0005;
  static constexpr double kTolerance_s = 0.02;
  /// Measurements farther apart are not compared: the device paused.
  static constexpr std::int64_t kMaxGapNs = 50'000'000;

  /// Adds a measurement, all in the device's frame. `estimated_m_per_s`: the velocity by the positions alone.
  /// Returns whether the claimed velocity is contradicted.
  bool add(const rt::Vec3& position_m, std::int64_t time_ns, const rt::Vec3& claimed_m_per_s,
           const rt::Vec3& estimated_m_per_s);

  /// Forgets what came before.
  void reset() { *this = {}; }

 private:
  bool started_ = false;
  std::int64_t time_ns_ = 0;
  rt::Vec3 position_m_;
  rt::Vec3 claimed_m_per_s_;
  rt::Vec3 error_m_;
  double speed_m_per_s_ = 0;  ///< largest of the last while
};

/// A measurement of a device in its own frame.
struct HandleMeasurement {
  rt::Vec3 position_m_in_handle;
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC of this computer
  std::uint32_t buttons = 0;
  bool calibrated = true;
  std::optional<rt::Vec3> velocity_m_per_s_in_handle = {};  ///< that the device claims; it is only checked
  double delay_s = 0;                                       ///< see rt::HandleState
  std::int64_t command_latency_ns = 0;                      ///< see rt::HandleState
  bool damps = false;                                       ///< see rt::HandleState
  std::optional<rt::Quaternion> orientation_in_handle =
      {};  ///< unit; maps vectors of the tool to the device's
  std::optional<double> gripper_rad = {};
  bool over_link = false;  ///< the device exerts forces over a link that cannot tell how late
};

/// Converts between the device's frame and the world frame: pose (T_world_handle), motion scale, clutch and
/// velocity, which is estimated from the positions. Positions that the device measures in steps are
/// interpolated. The HIP is  position + R (scale * p_in_handle) + offset, where the offset accumulates the
/// clutched displacements.
/// Thread: one.  Progress: wait-free.  RT: safe.
class HandleFrame {
 public:
  HandleFrame(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale);

  /// Begins a new session after the device was opened or reconnected; earlier positions do not count. The
  /// clutch offset is kept.
  void beginSession();

  /// Returns the state to publish; its sequence number is incremented each time.
  rt::HandleState stateOf(const HandleMeasurement& measurement);

  /// Converts a force or torque from world to device axes; zero if it is not finite.
  rt::Vec3 forceInHandle(const rt::Vec3& force_n_in_world) const;

  std::uint64_t session() const { return session_; }

 private:
  rt::Vec3 toWorldAxes(const rt::Vec3& v) const;

  std::array<double, 9> rotation_world_handle_;  // row by row
  rt::Quaternion orientation_world_handle_;
  rt::Vec3 origin_m_in_world_;
  double motion_scale_;
  int clutch_button_;
  double device_latency_s_;
  bool measures_latency_;
  PositionTracker tracker_;
  VelocityEstimator velocity_;
  VelocityCheck check_;
  bool distrusted_ = false;  // the device's velocity was contradicted in this session
  rt::Vec3 clutch_offset_m_in_world_;
  std::optional<rt::Vec3> held_hip_m_in_world_;  // while the clutch is held
  std::uint64_t session_ = 0;
  std::uint64_t sequence_ = 0;
};

}  // namespace hapticd::drivers
