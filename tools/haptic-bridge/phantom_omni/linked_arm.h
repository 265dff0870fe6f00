// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tools/haptic-bridge/phantom_omni/bench_arm.h"
#include "tools/haptic-bridge/phantom_omni/link.h"

namespace hapticd::tools::phantom_omni {

/// The arm of a device, with a thread of its own that keeps the link: packets without torque while nobody
/// steps, and from kLate_ns after the last step on. Thread: one, but for its own.
class LinkedArm final : public BenchArm {
 public:
  static constexpr std::int64_t kLate_ns = 100'000'000;

  /// `serial`: of the device; empty: the first one.
  /// Errors: it cannot be opened, no thread can be started.
  static base::Result<std::unique_ptr<LinkedArm>> open(const std::string& serial);
  /// Turns the motors off.
  ~LinkedArm() override;

  const std::string& serial() const { return serial_; }
  /// Whether the stylus was docked.  Errors: the device is lost.
  base::Result<bool> knowsPosition();

  base::Result<BenchStep> step(const PerJoint<int>& counts) override;
  base::Result<JointAngles> pausePackets(double seconds) override;
  std::uint64_t lateSteps() const override { return late_steps_; }

 private:
  explicit LinkedArm(std::unique_ptr<OmniLink> link) : serial_(link->serial()), link_(std::move(link)) {}
  void run();
  base::Result<void> turn();
  base::Result<void> steerPause(std::int64_t now_ns);
  OmniCommand command(std::int64_t now_ns);
  base::Result<JointAngles> newest();

  std::string serial_;
  std::thread thread_;
  std::atomic<bool> ends_{false};
  // its own thread
  std::unique_ptr<OmniLink> link_;
  Homing homing_;
  bool paused_ = false;
  // the other thread
  std::uint64_t late_steps_ = 0;
  std::int64_t returned_ns_ = 0;  // when the last step did
  // both
  std::mutex mutex_;
  std::condition_variable resumed_;
  std::optional<JointAngles> angles_rad_;
  std::optional<base::Error> lost_;
  PerJoint<int> counts_{};
  std::int64_t stepped_ns_ = 0;      // 0: nobody steps
  std::int64_t pause_until_ns_ = 0;  // 0: no pause
};

}  // namespace hapticd::tools::phantom_omni
