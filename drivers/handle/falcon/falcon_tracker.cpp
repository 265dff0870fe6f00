// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_tracker.h"

#include <algorithm>
#include <cmath>

namespace hapticd::drivers {
namespace {

// Scale of libnifalcon. Traces of the vendor's driver quoted there show 0.23 to 0.4 of it, hence
// `force_share`, which must be calibrated with a scale.
constexpr double kCountsPerNewtonMetre = -10000;

}  // namespace

FalconForce motorCountsFor(const FalconPose& pose, const rt::Vec3& force_n, double force_share) {
  FalconForce force;
  const std::array<double, 3> torques = thighTorquesOf(pose, force_n);
  std::array<double, 3> counts{};
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    counts[k] = kCountsPerNewtonMetre * force_share * torques[k];
    if (!std::isfinite(counts[k])) return {};
    largest = std::max(largest, std::abs(counts[k]));
  }
  if (largest > kMaxMotorCounts) force.exerted_share = kMaxMotorCounts / largest;
  for (std::size_t k = 0; k < 3; ++k) {
    force.motor_counts[k] = static_cast<int>(std::lround(force.exerted_share * counts[k]));
  }
  return force;
}

void FalconTracker::take(const FalconReply& reply) {
  takeHoming(reply.homed);
  pose_.reset();
  if (!homed_) return;
  const FalconAngles angles = thighAnglesOf(reply.encoder_counts);
  pose_ = falconPoseOf(angles, last_position_m_);
  if (!pose_) pose_ = falconPoseOf(angles, kFalconCentre_m);
  if (pose_) last_position_m_ = pose_->position_m;
}

void FalconTracker::takeHoming(std::uint8_t homed_encoders) {
  contrary_replies_ = (homed_encoders == kAllHomed) == homed_ ? 0 : contrary_replies_ + 1;
  if (contrary_replies_ < kSteadyReplies) return;
  homed_ = !homed_;
  contrary_replies_ = 0;
  last_position_m_ = kFalconCentre_m;
}

FalconOrder FalconTracker::orderFor(const std::optional<rt::Vec3>& force_n) {
  FalconOrder order;
  order.home = true;  // always, so that a loss of homing is noticed
  order.led = !homed_ ? FalconLed::red : force_n ? FalconLed::green : FalconLed::blue;
  force_cut_ = false;
  if (!pose_ || !force_n) return order;
  const FalconForce force = motorCountsFor(*pose_, *force_n, force_share_);
  order.motor_counts = force.motor_counts;
  force_cut_ = force.exerted_share < 1;
  return order;
}

}  // namespace hapticd::drivers
