// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <ostream>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/bridge_with_peer.h"
#include "tests/vendor_devices/emulated_arm.h"

namespace hapticd::test {

/// A kind of device with the fake library of its vendor.
struct VendorKind {
  std::string word;  ///< of the program
  std::string library;
  int model = 0;       ///< of the fake library
  double limit_n = 0;  ///< of that model
  std::string name() const { return word == "openhaptics" ? "OpenHaptics" : "ForceDimension"; }
};
inline void PrintTo(const VendorKind& kind, std::ostream* stream) {
  *stream << kind.word;
}
/// An omega.7 and a Touch.
inline VendorKind forceDimension() {
  return {"force-dimension", HAPTICD_FAKE_DRD, 35, 12};
}
inline VendorKind openHaptics() {
  return {"openhaptics", HAPTICD_FAKE_HD, 0, 3.3};
}

/// A hand that holds the handle at one place, turned.
inline drivers::SimulatedHandleSettings stillHand() {
  drivers::SimulatedHandleSettings hand;
  hand.start_m_in_world = {0.03, -0.02, 0.05};
  hand.direction_in_world = {1, 0.5, 0.2};
  hand.speed_m_per_s = 1e-6;
  return hand;
}

/// An emulated arm, a haptic-bridge that drives it, and the peer of that.
class BridgeUnderTest : public BridgeWithPeer {
 public:
  explicit BridgeUnderTest(VendorKind kind, const drivers::SimulatedHandleSettings& hand = stillHand())
      : kind_(std::move(kind)), arm_(folder_.path() / "arm", hand) {
    memory().model = kind_.model;
  }

  ArmMemory& memory() { return arm_.memory(); }
  void setFaults(std::uint32_t faults) { arm_.setFaults(faults); }
  const VendorKind& kind() const { return kind_; }

  void start(const std::vector<std::string>& more = {}) {
    std::vector<std::string> options{"--library", kind_.library};
    options.insert(options.end(), more.begin(), more.end());
    launch(kind_.word, options, {fmt::format("{}={}", kArmVariable, (folder_.path() / "arm").string())});
  }
  /// Starts, commands `force_n`, and waits until the arm exerts it.
  bool startPushing(const rt::Vec3& force_n = {0, 0, 2}) {
    peer().command({.force_n = force_n});
    start();
    return pushes();
  }
  bool pushes() {
    return becomesTrue([&] { return memory().exerted_n > 0; });
  }
  bool letsGo() {
    return becomesTrue([&] { return memory().exerted_n == 0; });
  }

 private:
  VendorKind kind_;
  TemporaryFolder folder_{memoryFolder()};
  EmulatedArm arm_;
};

}  // namespace hapticd::test
