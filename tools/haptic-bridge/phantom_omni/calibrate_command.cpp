// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/calibration.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"
#include "tools/haptic-bridge/phantom_omni/link.h"
#include "tools/lib/device_check/person.h"

namespace hapticd::tools::phantom_omni {
namespace {

/// The arm of a device, with a thread of its own that keeps the link: packets without torque while nobody
/// steps, and from kLate_ns after the last step on. Thread: one, but for its own.
class LinkedArm final : public BenchArm {
 public:
  static constexpr std::int64_t kLate_ns = 100'000'000;

  /// `serial`: of the device; empty: the first one.
  /// Errors: it cannot be opened, no thread can be started.
  static base::Result<std::unique_ptr<LinkedArm>> open(const std::string& serial) {
    auto link = OmniLink::open(serial);
    if (!link) return std::unexpected(link.error());
    std::unique_ptr<LinkedArm> arm(new LinkedArm(std::move(*link)));
    auto thread = drivers::startThread("device", [&arm = *arm] { arm.run(); });
    if (!thread) return std::unexpected(thread.error());
    arm->thread_ = std::move(*thread);
    return arm;
  }

  /// Turns the motors off.
  ~LinkedArm() override {
    ends_ = true;
    if (thread_.joinable()) thread_.join();
  }

  const std::string& serial() const { return serial_; }
  /// Whether the stylus was docked.  Errors: the device is lost.
  base::Result<bool> knowsPosition() {
    const std::lock_guard lock(mutex_);
    if (lost_) return std::unexpected(*lost_);
    return angles_rad_.has_value();
  }

  base::Result<BenchStep> step(const PerJoint<int>& counts) override {
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

  base::Result<JointAngles> pausePackets(double seconds) override {
    std::unique_lock lock(mutex_);
    pause_until_ns_ = rt::monotonicNow_ns() + static_cast<std::int64_t>(seconds * 1e9);
    resumed_.wait(lock, [this] { return pause_until_ns_ == 0 || lost_; });
    return newest();
  }

  std::uint64_t lateSteps() const override { return late_steps_; }

 private:
  explicit LinkedArm(std::unique_ptr<OmniLink> link) : serial_(link->serial()), link_(std::move(link)) {}
  void run() {
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

  base::Result<void> turn() {
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

  base::Result<void> steerPause(std::int64_t now_ns) {
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

  OmniCommand command(std::int64_t now_ns) {
    const bool steps = stepped_ns_ != 0 && now_ns - stepped_ns_ < kLate_ns;
    return {.counts = steps ? counts_ : PerJoint<int>{},
            .motors_on = steps,
            .light = angles_rad_ ? DockLight::steady : DockLight::fast_flash};
  }

  base::Result<JointAngles> newest() {
    if (lost_) return std::unexpected(*lost_);
    if (angles_rad_) return *angles_rad_;
    return std::unexpected(
        base::Error{"Phantom Omni", "does not know its position", "put the stylus into the inkwell"});
  }

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

int failed(const base::Error& error, int status) {
  fmt::print(stderr, "haptic-bridge: {}\n", error.text());
  return status;
}

base::Result<void> awaitDocked(LinkedArm& arm, Person& person) {
  constexpr auto kLook = std::chrono::milliseconds(50);
  constexpr auto kMost = std::chrono::seconds(120);
  person.say("Put the stylus into the inkwell, and wait.");
  for (const auto until = std::chrono::steady_clock::now() + kMost; std::chrono::steady_clock::now() < until;
       std::this_thread::sleep_for(kLook)) {
    const auto known = arm.knowsPosition();
    if (!known) return std::unexpected(known.error());
    if (*known) return {};
    if (person.givesUp()) return std::unexpected(base::Error{"calibration", "was given up", ""});
  }
  return std::unexpected(base::Error{"Phantom Omni", "was not docked within 120 s", ""});
}

base::Result<OmniCalibration> measure(const CalibrateOptions& options, Person& person) {
  const auto arm = LinkedArm::open(options.serial);
  if (!arm) return std::unexpected(arm.error());
  person.say(fmt::format(
      "Phantom Omni, serial number {}. Its motors will move the arm: keep hands off it unless you are "
      "asked to touch it.",
      (*arm)->serial()));
  if (auto ok = awaitDocked(**arm, person); !ok) return std::unexpected(ok.error());
  auto calibration = GainMeasurement(**arm, person, options.mass_kg).run();
  if (calibration) calibration->serial = (*arm)->serial();
  return calibration;
}

}  // namespace

int calibratePhantomOmni(const CalibrateOptions& options) {
  const Interrupt interrupt;  // no signal ends the program before the device is without force
  PersonAtTerminal person(interrupt);
  const auto calibration = measure(options, person);
  if (!calibration) return failed(calibration.error(), EX_UNAVAILABLE);
  const auto file = calibrationFile(options.file, calibration->serial);
  if (!file) return failed(file.error(), EX_CANTCREAT);
  if (auto ok = storeCalibration(*file, *calibration); !ok) return failed(ok.error(), EX_CANTCREAT);
  person.say(fmt::format("calibration written to {}", file->string()));
  if (calibration->releases_without_packets) return EX_OK;
  return failed(
      {"Phantom Omni",
       "keeps its torque when packets stop: nothing could end the force of a program that was killed",
       "it is of use without forces only"},
      EX_UNAVAILABLE);
}

}  // namespace hapticd::tools::phantom_omni
