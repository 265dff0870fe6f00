// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "daemon/base/box.h"
#include "drivers/led/led_panel.h"

namespace hapticd::daemon {

/// What the LEDs show of the box.
struct BoxCondition {
  rt::Mode mode = rt::Mode::starting;
  bool in_contact = false;  ///< there is something to feel
  drivers::CameraState camera = drivers::CameraState::absent;
  bool frames_damaged = false;  ///< one was within the last second
  bool warned = false;          ///< status has warnings
};

/// The table of what each LED shows when.  Pure.
LedPatterns patternsOf(const BoxCondition& condition);

/// Whether an LED with that pattern is on. All patterns begin together with each even second of the clock, so
/// that LEDs blink in step.  `time_ns`: CLOCK_MONOTONIC, at least 0.  Pure.
bool isLit(LedPattern pattern, std::int64_t time_ns);

/// The LEDs that are on.  `time_ns`: as of isLit().  Pure.
drivers::LedSet litLeds(const LedPatterns& patterns, std::int64_t time_ns);

/// Follows the box's counters: what has happened since a moment before.
/// Thread: one at a time.
class ConditionWatch {
 public:
  /// `time_ns`: CLOCK_MONOTONIC, not before that of the last call. Contact is any since the last call.
  BoxCondition follow(const BoxStatus& status, std::int64_t time_ns);

 private:
  std::uint64_t contact_ticks_ = 0;
  std::uint64_t damaged_frames_ = 0;
  std::optional<std::int64_t> last_damage_ns_;
};

}  // namespace hapticd::daemon
