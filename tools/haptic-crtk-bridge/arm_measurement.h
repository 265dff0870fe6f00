// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "drivers/handle/udp/conversation.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

namespace hapticd::tools::crtk {

/// One message of measured_cp.
struct MeasuredPose {
  std::string frame;
  std::int64_t stamp_utc_ns = 0;
  rt::Vec3 position_m;         ///< in that frame
  rt::Quaternion orientation;  ///< maps vectors of the tool to that frame
  std::uint64_t publisher = 0;
};

/// What is wrong with a message of measured_cp.
enum class PoseFault : std::uint8_t {
  none,
  zero_stamp,       ///< by which CRTK marks invalid data
  not_finite,       ///< a position
  not_unit,         ///< an orientation whose quaternion has not the length 1
  not_newer,        ///< its stamp is not after that of the message before
  other_publisher,  ///< than that of the first message of this session
  other_frame,      ///< than that of the first message of all
};
inline constexpr std::size_t kPoseFaults = 7;

/// Accepts or rejects measurements of an arm, and counts what it rejects. Thread: one.
class PoseGate {
 public:
  /// `frame`: which all measurements must have; empty: that of the first one.
  explicit PoseGate(std::string frame) : frame_(std::move(frame)) {}

  /// From now on another publisher may measure. The frame stays: the handle's pose in hapticd's settings is
  /// that of this frame, and a force in another one points somewhere else.
  void beginSession();
  PoseFault judge(const MeasuredPose& pose);
  const std::string& frame() const { return frame_; }
  std::uint64_t rejected(PoseFault fault) const { return counts_[static_cast<std::size_t>(fault)]; }
  /// What was rejected last; none: nothing was in this session.
  PoseFault lastFault() const { return last_fault_; }

 private:
  PoseFault faultOf(const MeasuredPose& pose) const;

  std::string frame_;
  std::uint64_t publisher_ = 0;
  std::int64_t stamp_utc_ns_ = 0;
  PoseFault last_fault_ = PoseFault::none;
  std::array<std::uint64_t, kPoseFaults> counts_{};
};

/// In words, after "a measurement was rejected: ".
const char* textOf(PoseFault fault);

/// What an arm and the network to it add to the delay from a motion to the force that responds to it.
///
/// The way to here is the age of a measurement when it arrives, by its stamp; no message says how long a
/// force takes to the arm, so the same is assumed for that. Both sides work in periods: a measurement is held
/// for half a period on average until the next one, and a force waits for half a period and acts for half
/// another one on average. Where the stamps cannot be those of this computer's clock, kUnknownWay_ns is
/// assumed in each direction.
/// Thread: one.
class ArmDelay {
 public:
  static constexpr std::int64_t kUnknownWay_ns = 10'000'000;
  /// An older measurement has a stamp of another clock, or is of no use.
  static constexpr std::int64_t kOldest_ns = 100'000'000;
  /// So many stamps in a row have to be plausible before they count.
  static constexpr int kProven = 100;

  /// One measurement, by its stamp, and when it arrived; both UTC.
  void add(std::int64_t stamp_utc_ns, std::int64_t arrived_utc_ns);
  /// Whether the stamps are taken for those of a clock that goes with this computer's.
  bool trustsStamps() const { return plausible_in_a_row_ >= kProven; }
  /// Whether there were enough measurements to tell.
  bool measured() const { return count_ >= kProven; }
  /// From a motion at the arm to the arrival of its measurement, without its being held.
  std::int64_t way_ns() const;
  /// 95th percentile of the time between two measurements; 0: not known yet.
  std::int64_t period_ns() const { return periods_.ninetyFifthPercentileNs(); }
  std::int64_t latency_ns() const { return 2 * way_ns() + 3 * period_ns() / 2; }
  void reset() { *this = {}; }

 private:
  drivers::udp::DelayEstimate ages_;
  drivers::udp::DelayEstimate periods_;
  std::int64_t last_stamp_utc_ns_ = 0;
  int plausible_in_a_row_ = 0;
  int count_ = 0;
};

/// How an arm takes a wrench.
enum class WrenchConvention : std::uint8_t {
  body_absolute,  ///< body/servo_cf, at the tip, along the axes of the frame of measured_cp
  body,           ///< body/servo_cf, at the tip, along the axes of the tip
  base,           ///< as body_absolute, by an arm that knows no other axes and so takes no setting of them
  spatial,        ///< spatial/servo_cf, along the axes of the frame of local/measured_cp, about its origin
};

struct Wrench {
  rt::Vec3 force_n;
  rt::Vec3 torque_n_m;
};

/// The wrench by which an arm exerts a force at its tip, and no torque there. `force_n_in_frame` and
/// `T_frame_tip`: in the frame of the measurements. In the spatial convention a wrench acts at the origin of
/// the frame, where a force at the tip has a torque.
inline Wrench wrenchOf(WrenchConvention convention, const rt::Vec3& force_n_in_frame,
                       const rt::RigidPose& T_frame_tip) {
  switch (convention) {
    case WrenchConvention::body_absolute:
    case WrenchConvention::base:
      break;
    case WrenchConvention::body:
      return {rotated(inverse(T_frame_tip.orientation), force_n_in_frame), {}};
    case WrenchConvention::spatial:
      return {force_n_in_frame, cross(T_frame_tip.position_m_in_world, force_n_in_frame)};
  }
  return {force_n_in_frame, {}};
}

}  // namespace hapticd::tools::crtk
