// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "config/settings.h"
#include "drivers/handle/handle_frame.h"
#include "drivers/handle/hid/spacemouse_motion.h"
#include "drivers/handle/hid/spacemouse_report.h"

namespace hapticd::drivers {

/// A SpaceMouse as a handle that exerts nothing: neither waits nor reads. Where it has moved the HIP stays
/// over losses of the device.  Thread: one.
class HidSpaceMouse {
 public:
  static constexpr double kReachM = 0.5;  ///< of the HIP from its origin, per axis

  HidSpaceMouse(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale);

  /// The device was opened: a new session, with the cap released.
  void opened(std::int64_t now_ns);
  void take(std::span<const std::uint8_t> report);
  /// The state to publish, moved on to `now_ns`.
  rt::HandleState state(std::int64_t now_ns);

  std::uint64_t measurements() const { return measurements_; }
  std::uint64_t rejected() const { return rejected_; }

 private:
  HandleFrame frame_;
  SpaceMouseMotion motion_;
  SpaceMouseState cap_;
  std::int64_t last_ns_ = 0;
  std::uint64_t measurements_ = 0;
  std::uint64_t rejected_ = 0;
};

}  // namespace hapticd::drivers
