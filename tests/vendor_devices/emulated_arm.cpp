// SPDX-License-Identifier: Apache-2.0
#include "tests/vendor_devices/emulated_arm.h"

#include <algorithm>

#include "rt/base/clock.h"

namespace hapticd::test {

EmulatedArm::EmulatedArm(const std::filesystem::path& path, const drivers::SimulatedHandleSettings& hand)
    : mapped_(path, true), hand_(hand, static_cast<double>(kStep_ns) * 1e-9) {
  measure(rt::monotonicNow_ns());
  thread_ = std::thread([this] { run(); });
}

EmulatedArm::~EmulatedArm() {
  ends_ = true;
  thread_.join();
}

rt::Vec3 EmulatedArm::exertedForce(std::int64_t now_ns) const {
  const ArmMemory& arm = memory();
  const std::int64_t watchdog_ns = arm.watchdog_ns;
  const bool dropped = watchdog_ns > 0 && now_ns - arm.force_ns > watchdog_ns;
  if (!arm.force_on || arm.brakes || dropped || (arm.faults & kArmForceCut) != 0) return {};
  return {arm.force_n[0], arm.force_n[1], arm.force_n[2]};
}

void EmulatedArm::keepWatchdog(std::int64_t now_ns) {
  ArmMemory& arm = memory();
  const bool runs_out = arm.watchdog_ns > 0 && now_ns - arm.force_ns > arm.watchdog_ns;
  if (!arm.watchdog_latches || !arm.force_on || !runs_out) return;
  arm.force_on = false;
  ++arm.watchdog_trips;
}

void EmulatedArm::measure(std::int64_t now_ns) {
  ArmMemory& arm = memory();
  const rt::Vec3 place = hand_.position_m_in_world();
  const rt::Quaternion held = hand_.orientation_in_world();
  const std::array<double, 3> places{place.x, place.y, place.z};
  const std::array<double, 4> components{held.x, held.y, held.z, held.w};
  for (std::size_t i = 0; i < 3; ++i) arm.position_m[i] = places[i];
  for (std::size_t i = 0; i < 4; ++i) arm.orientation[i] = components[i];
  arm.gripper_rad = hand_.gripper_rad();
  arm.measured_ns = now_ns;
}

void EmulatedArm::run() {
  ArmMemory& arm = memory();
  std::int64_t moved_to_ns = rt::monotonicNow_ns();
  while (!ends_) {
    rt::sleepUntil(moved_to_ns + kStep_ns);
    const std::int64_t now_ns = rt::monotonicNow_ns();
    keepWatchdog(now_ns);
    const rt::Vec3 force_n = exertedForce(now_ns);
    const double exerted_n = norm(force_n);
    arm.exerted_n = exerted_n;
    if (exerted_n > 0) arm.last_exerted_ns = now_ns;
    if (exerted_n > arm.most_exerted_n) arm.most_exerted_n = exerted_n;
    if (exerted_n > 0 && (arm.faults & kArmNotCalibrated) != 0) ++arm.uncalibrated_force_steps;
    // a test on a loaded machine: the hand does not wait for it, but makes no leaps either
    constexpr std::int64_t kMostBehind_ns = 50'000'000;
    moved_to_ns = std::max(moved_to_ns, now_ns - kMostBehind_ns);
    for (; now_ns - moved_to_ns >= kStep_ns; moved_to_ns += kStep_ns) hand_.step(force_n);
    measure(now_ns);
  }
}

}  // namespace hapticd::test
