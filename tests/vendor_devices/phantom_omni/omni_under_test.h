// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/bridge_with_peer.h"
#include "tests/vendor_devices/phantom_omni/emulated_omni.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"

namespace hapticd::test {

/// The serial number of the emulated device, and its register: a = 4, b = 10, c = 23, d = 1, e = 321.
inline constexpr std::uint32_t kOmniSerialRegister =
    0x80000001 | 4U << 23 | 10U << 19 | 23U << 14 | 1U << 11 | 321U << 1;
inline constexpr const char* kOmniSerial = "41023100321";

/// An emulated Omni, a haptic-bridge that drives it, and the peer of that.
class OmniUnderTest : public BridgeWithPeer {
 public:
  explicit OmniUnderTest(const OmniModelSettings& settings = {}, unsigned int seed = 1)
      : settings_(settings), omni_(folder_.path() / "omni", settings, seed) {
    memory().serial_register = kOmniSerialRegister;
  }

  EmulatedOmni& omni() { return omni_; }
  OmniMemory& memory() { return omni_.memory(); }
  const OmniModelSettings& settings() const { return settings_; }
  std::vector<std::string> environment() const {
    return {fmt::format("{}={}", kOmniVariable, (folder_.path() / "omni").string()),
            "LD_LIBRARY_PATH=" HAPTICD_FAKE_RAW1394_FOLDER, "XDG_STATE_HOME=" + folder_.path().string()};
  }
  std::filesystem::path calibrationFile() const {
    return folder_.path() / "haptic-vendor-bridge" / fmt::format("phantom-omni-{}.json", kOmniSerial);
  }
  /// Stores the gains that the device has.
  void calibrate(bool releases = true) {
    const tools::phantom_omni::OmniCalibration calibration{kOmniSerial, settings_.n_m_per_count, releases};
    (void)tools::phantom_omni::storeCalibration(calibrationFile(), calibration);
  }

  void start(const std::vector<std::string>& more = {}) { launch("phantom-omni", more, environment()); }
  /// Whether it becomes ready where it is docked.
  bool becomesReady() {
    return stateBecomes([](const auto& state) { return !state.fault && state.calibrated; });
  }
  /// A hand brings it to `pose_rad`.
  bool bringTo(const OmniJoints& pose_rad) {
    omni_.holdAt(pose_rad);
    return becomesTrue([&] { return omni_.hasArrived(); }) && passStates(20);
  }
  /// Starts the calibrated device, has a hand bring it to `pose_rad`, commands `force_n`, and waits for it.
  bool startPushing(const rt::Vec3& force_n = {0, 0, 2}, const OmniJoints& pose_rad = {0.2, 0.5, 0.3}) {
    calibrate();
    start();
    if (!becomesReady() || !bringTo(pose_rad)) return false;
    peer().command({.force_n = force_n});
    return pushes();
  }
  bool pushes() {
    return becomesTrue([&] { return omni_.isExerting(); });
  }
  bool letsGo() {
    return becomesTrue([&] { return !omni_.isExerting(); });
  }
  /// Without torque and with its motors off.
  bool isOff() {
    for (const auto& dac : memory().dac) {
      if (dac != 0x7ff) return false;
    }
    return !omni_.motorsOn();
  }

 private:
  OmniModelSettings settings_;
  TemporaryFolder folder_{memoryFolder()};
  EmulatedOmni omni_;
};

}  // namespace hapticd::test
