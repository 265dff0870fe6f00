// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <string>

#include "config/base/error.h"
#include "rt/base/words.h"

namespace hapticd::drivers {

/// Meaning of an LED; the configuration assigns it to a line.
enum class Led : std::size_t { power, camera, contact, fault };
constexpr auto wordsOf(Led) {
  return rt::words<Led>("power", "camera", "contact", "fault");
}
inline constexpr std::size_t kLedCount = rt::enumeratorCount<Led>();

/// A set of LEDs: bit n stands for the Led with the value n.
using LedSet = std::bitset<kLedCount>;

/// Connection state of the LEDs.
enum class LedState {
  none,     ///< no LEDs are configured
  present,  ///< all configured LEDs can be switched
  absent,   ///< at least one has not been found yet; the driver keeps searching
  lost,     ///< at least one was found but is lost; the driver keeps trying to reconnect
};
constexpr auto wordsOf(LedState) {
  return rt::words<LedState>("none", "present", "absent", "lost");
}

/// State of the LEDs as shown to people and to clients of the control API.
struct LedStatus {
  LedState state = LedState::none;
  std::string detail;    ///< for people: why LEDs are absent or lost, and what to do
  std::string identity;  ///< driver and chip
  LedSet configured;     ///< the LEDs that have a line
};

/// The LEDs of the box. Their absence or loss is a state from which the driver recovers by itself, never an
/// error of the process.
class LedPanel {
 public:
  virtual ~LedPanel() = default;
  /// Starts with all LEDs off.
  /// Errors: permanent ones only (an invalid line address, a thread that cannot be started).
  virtual base::Result<void> start() = 0;
  /// Switches all LEDs off and releases their lines. Does nothing if not started.
  virtual void stop() = 0;
  /// Switches these LEDs on and the others off. Returns at once; the newest call wins.
  /// Thread: any.
  virtual void show(LedSet lit) = 0;
  /// Returns the current state.  Thread: any.
  virtual LedStatus status() const = 0;
};

/// LED driver of a box without LEDs.
class NoLeds final : public LedPanel {
 public:
  base::Result<void> start() override { return {}; }
  void stop() override {}
  void show(LedSet) override {}
  LedStatus status() const override { return {LedState::none, "", "none", {}}; }
};

}  // namespace hapticd::drivers
