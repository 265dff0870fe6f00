// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/force_dimension/force_dimension_driver.h"

#include <fmt/format.h>

#include <charconv>

#include "tools/haptic-bridge/force_dimension/open_dhd_device.h"

namespace hapticd::tools {

DeviceLimits limitsOfDhdType(int type, const DhdCapabilities& capabilities) {
  constexpr int kDelta3 = 63;
  constexpr int kFirstOmega = 33;
  constexpr int kLastOmega = 37;
  constexpr double kDeltaN = 20;
  constexpr double kOmegaN = 12;
  constexpr double kUnknownN = 8;     // less than any of them exerts
  constexpr double kUnknownNM = 0.1;  // nobody has published any
  constexpr double kGripperN = 8;
  const bool omega = type >= kFirstOmega && type <= kLastOmega;
  return {.force_n = type == kDelta3 ? kDeltaN
                     : omega         ? kOmegaN
                                     : kUnknownN,
          .torque_n_m = capabilities.active_wrist ? kUnknownNM : 0,
          .gripper_force_n = capabilities.active_gripper ? kGripperN : 0};
}

base::Result<char> ForceDimensionDriver::open() const {
  int id = -1;
  if (serial_.empty()) {
    id = dhd_->open();
  } else {
    int serial = 0;
    const char* end = serial_.data() + serial_.size();
    if (const auto parsed = std::from_chars(serial_.data(), end, serial);
        parsed.ec != std::errc{} || parsed.ptr != end)
      return std::unexpected(base::Error{"--device", fmt::format("\"{}\" is no serial number", serial_), ""});
    id = dhd_->open_serial(serial);
  }
  if (id >= 0) return static_cast<char>(id);
  return std::unexpected(
      base::Error{"Force Dimension device",
                  fmt::format("cannot be opened: {}; {} connected", dhd_->lastError(), dhd_->device_count()),
                  "plug it in, end other programs that use it, and permit this user to use its USB device"});
}

base::Result<void> ForceDimensionDriver::drive(DeviceSession& session) {
  if (!dhd_) {
    auto loaded = Dhd::load(library_);
    if (!loaded) return std::unexpected(loaded.error());
    dhd_ = *loaded;
  }
  const auto id = open();
  if (!id) return std::unexpected(id.error());
  OpenDhdDevice device(*dhd_, *id, session);
  const auto initialised = device.awaitInitialised();
  if (!initialised) return std::unexpected(initialised.error());
  if (!*initialised) return {};
  if (auto ok = device.prepare(); !ok) return ok;
  return device.run();
}

}  // namespace hapticd::tools
