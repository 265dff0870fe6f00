// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "config/settings.h"
#include "drivers/handle/handle_frame.h"
#include "drivers/handle/hid/spacemouse_motion.h"
#include "drivers/handle/hid/spacemouse_report.h"

namespace hapticd::drivers {

/// A SpaceMouse as a handle without forces; it neither waits nor reads. The HIP keeps its position when the
/// device is lost.
/// Thread: one.
class HidSpaceMouse {
 public:
  static constexpr double kReachM = 0.5;  ///< of the HIP from its origin, per axis

  HidSpaceMouse(const config::HandleSettings& settings, const rt::HandleScaleParameters& scale);

  /// Called when the device has been opened: begins a new session with the cap released.
  void opened(std::int64_t now_ns);
  /// Processes an input report.
  void take(std::span<const std::uint8_t> report);
  /// Integrates the motion up to `now_ns` and returns the state to publish.
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
