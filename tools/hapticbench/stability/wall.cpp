// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/wall.h"

#include <algorithm>
#include <cmath>

namespace hapticd::tools {
namespace {

constexpr double kPeriod_s = 0.001;
constexpr double kDistance_m = 1;
constexpr std::uint16_t kRaw = 1000;

/// 1/Z = 1.3 - 0.0003 d: steps of 0.3 mm at 1 m, and exactly 1 m at kRaw.
rt::DepthModelParameters fineDepthModel() {
  rt::DepthModelParameters model;
  model.a_per_m = -0.0003;
  model.b_per_m = 1.3;
  model.near_m = 0.8;
  model.far_m = 1.4;
  return model;
}

/// Off the lattice of points, near the optical axis.
rt::Vec3 hipAt(double h_m) {
  return {0.00037, -0.00052, h_m - kDistance_m};
}

bool pushesBeforeContact(rt::ForceLaw law) {
  return law == rt::ForceLaw::nearest_springs || law == rt::ForceLaw::smooth_springs;
}

}  // namespace

double ReferenceWall::force_n(double h_m, double velocity_m_per_s) {
  return h_m >= 0 ? 0 : std::max(0.0, -stiffness_ * h_m - damping_ * velocity_m_per_s);
}

CoreWall::CoreWall(rt::ForceLaw law, const rt::LiveParameters& parameters, CoreOutput output)
    : box_(fineDepthModel(), {}, {}), output_(output), frame_(std::make_unique<rt::DepthFrame>()) {
  std::fill(frame_->image().begin(), frame_->image().end(), kRaw);
  frame_->sequence = 1;
  box_.parameters() = parameters;
  box_.parameters().law = law;
  box_.parameters().safety.engage_ramp_s = 0;
  if (output == CoreOutput::law) {
    box_.parameters().safety.max_force_n = 1e6;
    box_.parameters().safety.max_slew_n_per_s = 1e9;
  }
  box_.show(*frame_);
}

void CoreWall::set(double stiffness_n_per_m, double damping_n_s_per_m) {
  box_.parameters().springs.stiffness_n_per_m = stiffness_n_per_m;
  box_.parameters().contact.damping_n_s_per_m = damping_n_s_per_m;
}

void CoreWall::approach(double h_m) {
  constexpr double kFree_m = 0.06;
  constexpr double kStep_m = 0.0005;
  for (double free_m = kFree_m; free_m > h_m; free_m -= kStep_m) force_n(free_m, 0);
  force_n(h_m, 0);
}

double CoreWall::force_n(double h_m, double velocity_m_per_s) {
  const rt::Tick tick = box_.tick(hipAt(h_m), kPeriod_s, {0, 0, velocity_m_per_s}, delay_s_);
  stiffness_gain_ = tick.stiffness_gain;
  return (output_ == CoreOutput::law ? tick.law_force_n_in_world : tick.command_force_n_in_world).z;
}

double CoreWall::onset_m() const {
  const rt::LiveParameters& parameters = box_.parameters();
  return pushesBeforeContact(parameters.law) ? parameters.springs.radius_m : 0;
}

}  // namespace hapticd::tools
