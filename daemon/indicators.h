// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "daemon/base/box.h"
#include "drivers/led/led_panel.h"

namespace hapticd::daemon {

/// The parts of the box's status that the LEDs show.
struct BoxCondition {
  rt::Mode mode = rt::Mode::starting;
  bool in_contact = false;    ///< a force acts on the HIP
  bool near_fixture = false;  ///< a forbidden region is nearer than proximity.warning_m
  drivers::CameraState camera = drivers::CameraState::absent;
  bool frames_damaged = false;  ///< at least one frame within the last second was damaged
  bool warned = false;          ///< the status has warnings
};

/// The pattern of each LED for a given state of the box.  Pure.
LedPatterns patternsOf(const BoxCondition& condition);

/// Whether an LED with that pattern is lit at a given time. All patterns start at each even second of the
/// clock, so that LEDs blink in step.  `time_ns`: CLOCK_MONOTONIC, at least 0.  Pure.
bool isLit(LedPattern pattern, std::int64_t time_ns);

/// The LEDs that are lit at a given time.  `time_ns`: as for isLit().  Pure.
drivers::LedSet litLeds(const LedPatterns& patterns, std::int64_t time_ns);

/// Derives what the LEDs show from the box's counters, by comparing them with those of a moment ago.
/// Thread: one at a time.
class ConditionWatch {
 public:
  /// `time_ns`: CLOCK_MONOTONIC, not earlier than in the last call. Any contact since the last call counts.
  BoxCondition follow(const BoxStatus& status, std::int64_t time_ns);

 private:
  std::uint64_t contact_ticks_ = 0;
  std::uint64_t damaged_frames_ = 0;
  std::optional<std::int64_t> last_damage_ns_;
};

}  // namespace hapticd::daemon
