// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <string>

#include "config/error.h"
#include "rt/words.h"

namespace hapticd::drivers {

/// What an LED means; which line it is on is configuration.
enum class Led : std::size_t { power, camera, contact, fault };
constexpr auto wordsOf(Led) {
  return rt::words<Led>("power", "camera", "contact", "fault");
}
inline constexpr std::size_t kLedCount = rt::enumeratorCount<Led>();

/// A bit for each Led, at its number: of the LEDs that are on, or that there are.
using LedSet = std::bitset<kLedCount>;

enum class LedState {
  none,     ///< no LEDs are configured
  present,  ///< all configured LEDs can be switched
  absent,   ///< at least one has not been found yet; the driver keeps looking
  lost,     ///< at least one could be switched before; the driver keeps trying to get it back
};
constexpr auto wordsOf(LedState) {
  return rt::words<LedState>("none", "present", "absent", "lost");
}

struct LedStatus {
  LedState state = LedState::none;
  std::string detail;    ///< for people: why LEDs are absent or lost, and what to do
  std::string identity;  ///< driver and chip
  LedSet configured;     ///< those that have a line
};

/// The LEDs of the box. Absence or loss of them is a state that the driver recovers from by itself, never an
/// error of the process.
class LedPanel {
 public:
  virtual ~LedPanel() = default;
  /// Starts with all LEDs off.
  /// Errors: permanent ones only (a line that cannot be read, a thread that cannot be started).
  virtual config::Result<void> start() = 0;
  /// Switches all LEDs off and gives their lines back. Harmless when not started.
  virtual void stop() = 0;
  /// These LEDs are to be on and the others off. Returns at once; the newest call wins.
  /// Thread: any.
  virtual void show(LedSet lit) = 0;
  /// Thread: any.
  virtual LedStatus status() const = 0;
};

}  // namespace hapticd::drivers
