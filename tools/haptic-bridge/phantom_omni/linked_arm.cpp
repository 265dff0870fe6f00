// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/linked_arm.h"

#include <utility>

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::tools::phantom_omni {

base::Result<std::unique_ptr<LinkedArm>> LinkedArm::open(const std::string& serial) {
  auto link = OmniLink::open(serial);
  if (!link) return std::unexpected(link.error());
  std::unique_ptr<LinkedArm> arm(new LinkedArm(std::move(*link)));
  auto thread = drivers::startThread("device", [&arm = *arm] { arm.run(); });
  if (!thread) return std::unexpected(thread.error());
  arm->thread_ = std::move(*thread);
  return arm;
}

LinkedArm::~LinkedArm() {
  ends_ = true;
  if (thread_.joinable()) thread_.join();
}

void LinkedArm::run() {
  while (!ends_) {
    const auto turned = turn();
    if (turned) continue;
    const std::lock_guard lock(mutex_);
    lost_ = turned.error();
    resumed_.notify_all();
    break;
  }
  link_.reset();
}

base::Result<void> LinkedArm::turn() {
  const auto received = link_->receive();
  if (!received) return std::unexpected(received.error());
  const std::int64_t now_ns = rt::monotonicNow_ns();
  OmniCommand next;
  {
    const std::lock_guard lock(mutex_);
    if (*received) angles_rad_ = homing_.anglesAt((*received)->reading, (*received)->measured_ns);
    if (auto ok = steerPause(now_ns); !ok) return ok;
    next = command(now_ns);
  }
  return link_->send(next);
}

base::Result<void> LinkedArm::steerPause(std::int64_t now_ns) {
  const bool pauses = now_ns < pause_until_ns_;
  if (pauses == paused_) return {};
  paused_ = pauses;
  if (pauses) {
    link_->interrupt();
    return {};
  }
  pause_until_ns_ = stepped_ns_ = 0;
  resumed_.notify_all();
  (void)link_->send(command(now_ns));  // what is filled in first has no torque
  return link_->resume();
}

OmniCommand LinkedArm::command(std::int64_t now_ns) {
  const bool steps = stepped_ns_ != 0 && now_ns - stepped_ns_ < kLate_ns;
  return {.counts = steps ? counts_ : PerJoint<int>{},
          .motors_on = steps,
          .light = angles_rad_ ? DockLight::steady : DockLight::fast_flash};
}

base::Result<JointAngles> LinkedArm::newest() {
  if (lost_) return std::unexpected(*lost_);
  if (angles_rad_) return *angles_rad_;
  return std::unexpected(
      base::Error{"Phantom Omni", "does not know its position", "put the stylus into the inkwell"});
}

base::Result<bool> LinkedArm::knowsPosition() {
  const std::lock_guard lock(mutex_);
  if (lost_) return std::unexpected(*lost_);
  return angles_rad_.has_value();
}

base::Result<BenchStep> LinkedArm::step(const PerJoint<int>& counts) {
  constexpr auto kStep_ns = static_cast<std::int64_t>(kStep_s * 1e9);
  const std::int64_t now_ns = rt::monotonicNow_ns();
  {
    const std::lock_guard lock(mutex_);
    if (stepped_ns_ != 0 && now_ns - stepped_ns_ >= kLate_ns) ++late_steps_;
    counts_ = counts;
    stepped_ns_ = now_ns;
  }
  rt::sleepUntil(now_ns + kStep_ns);
  const std::lock_guard lock(mutex_);
  const auto angles_rad = newest();
  if (!angles_rad) return std::unexpected(angles_rad.error());
  const std::int64_t before_ns = std::exchange(returned_ns_, rt::monotonicNow_ns());
  // the first step after a pause has none before it
  const std::int64_t since_ns = returned_ns_ - before_ns < kLate_ns ? returned_ns_ - before_ns : kStep_ns;
  return BenchStep{*angles_rad, static_cast<double>(since_ns) * 1e-9};
}

base::Result<JointAngles> LinkedArm::pausePackets(double seconds) {
  std::unique_lock lock(mutex_);
  pause_until_ns_ = rt::monotonicNow_ns() + static_cast<std::int64_t>(seconds * 1e9);
  resumed_.wait(lock, [this] { return pause_until_ns_ == 0 || lost_; });
  return newest();
}

}  // namespace hapticd::tools::phantom_omni
