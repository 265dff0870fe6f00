// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-crtk-bridge/arm_measurement.h"

#include <algorithm>
#include <cmath>

namespace hapticd::tools::crtk {

void PoseGate::beginSession() {
  publisher_ = 0;
  stamp_utc_ns_ = 0;
  last_fault_ = PoseFault::none;
}

PoseFault PoseGate::faultOf(const MeasuredPose& pose) const {
  constexpr double kRounding = 1e-3;  // of a rotation matrix in float
  if (pose.stamp_utc_ns == 0) return PoseFault::zero_stamp;
  if (!isFinite(pose.position_m)) return PoseFault::not_finite;
  if (!(std::abs(dot(pose.orientation, pose.orientation) - 1) < kRounding)) return PoseFault::not_unit;
  if (publisher_ != 0 && pose.publisher != publisher_) return PoseFault::other_publisher;
  if (!frame_.empty() && pose.frame != frame_) return PoseFault::other_frame;
  if (pose.stamp_utc_ns <= stamp_utc_ns_) return PoseFault::not_newer;
  return PoseFault::none;
}

PoseFault PoseGate::judge(const MeasuredPose& pose) {
  const PoseFault fault = faultOf(pose);
  ++counts_[static_cast<std::size_t>(fault)];
  if (fault != PoseFault::none) return last_fault_ = fault;
  frame_ = pose.frame;
  publisher_ = pose.publisher;
  stamp_utc_ns_ = pose.stamp_utc_ns;
  return fault;
}

const char* textOf(PoseFault fault) {
  switch (fault) {
    case PoseFault::none:
      return "nothing is wrong";
    case PoseFault::zero_stamp:
      return "its stamp is zero, by which CRTK marks invalid data";
    case PoseFault::not_finite:
      return "its position is not finite";
    case PoseFault::not_unit:
      return "the quaternion of its orientation has not the length 1";
    case PoseFault::not_newer:
      return "its stamp is not after that of the one before";
    case PoseFault::other_publisher:
      return "another program publishes it than before";
    case PoseFault::other_frame:
      return "its frame_id is another one than before";
  }
  return "";
}

void ArmDelay::add(std::int64_t stamp_utc_ns, std::int64_t arrived_utc_ns) {
  const std::int64_t period_ns = stamp_utc_ns - last_stamp_utc_ns_;
  if (last_stamp_utc_ns_ != 0 && period_ns > 0 && period_ns < kOldest_ns) periods_.add(period_ns);
  last_stamp_utc_ns_ = stamp_utc_ns;
  count_ = std::min(count_ + 1, kProven);
  const std::int64_t age_ns = arrived_utc_ns - stamp_utc_ns;
  if (age_ns < 0 || age_ns > kOldest_ns) {
    plausible_in_a_row_ = 0;
    ages_.reset();
    return;
  }
  plausible_in_a_row_ = std::min(plausible_in_a_row_ + 1, kProven);
  ages_.add(age_ns);
}

std::int64_t ArmDelay::way_ns() const {
  return trustsStamps() ? ages_.ninetyFifthPercentileNs() : kUnknownWay_ns;
}

}  // namespace hapticd::tools::crtk
