// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/handle/udp/udp_socket.h"
#include "rt/base/vec3.h"
#include "tests/system/support/daemon_under_test.h"
#include "tools/lib/bridge/bridge.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::test {

/// A hand that is where the test puts it, at a device behind haptic-bridge.
class PlacedHand : private tools::Device {
 public:
  /// It begins where `start_m` is.
  explicit PlacedHand(const rt::Vec3& start_m);
  ~PlacedHand() override;

  /// What a configuration has to contain for a daemon that this hand shall reach.
  static std::string yaml();
  /// Glides to a place, rests there, and waits until the daemon has it there.
  bool reaches(Daemon& daemon, const rt::Vec3& position_m);
  void holdButton(bool held) { button_ = held; }
  /// Goes to and fro by this much along x until it glides to another place.
  void tremble(double metres) { tremble_m_ = metres; }

 private:
  tools::DeviceReading read() override;
  void exert(const tools::DeviceCommand& /*command*/) override {}
  tools::DeviceLimits limits() const override { return {.force_n = 10}; }

  std::mutex mutex_;
  rt::Vec3 position_m_;
  rt::Vec3 aim_m_;
  std::atomic<bool> button_ = false;
  std::atomic<double> tremble_m_ = 0;
  std::uint64_t readings_ = 0;
  drivers::udp::UdpSocket socket_;
  tools::Bridge bridge_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

}  // namespace hapticd::test
