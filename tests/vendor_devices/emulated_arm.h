// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <thread>

#include "drivers/handle/simulated/simulated_hand.h"
#include "tests/vendor_devices/mapped_arm.h"

namespace hapticd::test {

/// A device in a person's hand, in real time: four steps a millisecond. It exerts what the library set while
/// the amplifier is on and the brakes are off, and until its watchdog runs out. Thread: one.
class EmulatedArm {
 public:
  static constexpr std::int64_t kStep_ns = 250'000;

  /// The hand moves in the device's axes.
  EmulatedArm(const std::filesystem::path& path, const drivers::SimulatedHandleSettings& hand);
  ~EmulatedArm();

  ArmMemory& memory() const { return mapped_.memory(); }
  void setFaults(std::uint32_t faults) { memory().faults = faults; }

 private:
  void run();
  void measure(std::int64_t now_ns);
  void keepWatchdog(std::int64_t now_ns);
  rt::Vec3 exertedForce(std::int64_t now_ns) const;

  MappedArm mapped_;
  drivers::SimulatedHand hand_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace hapticd::test
