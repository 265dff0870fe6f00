// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include "rt/loop/loop_state.h"

namespace hapticd::tools::ros {

/// The state of a device as CRTK has it.
struct OperatingState {
  std::string_view state;  ///< DISABLED, ENABLED, PAUSED or FAULT
  bool is_homed = false;   ///< its positions mean something
  bool is_busy = false;    ///< it is on its way to a state, and what it is asked for has to wait

  friend bool operator==(const OperatingState&, const OperatingState&) = default;
};

/// Of a box that was paused over the network.
inline constexpr std::string_view kPaused = "PAUSED";

/// While hapticd does not answer.
inline constexpr OperatingState kBoxAbsent{"DISABLED", false, false};

/// A handle whose newest measurement is older than this is not homed: it may be elsewhere by now.
inline constexpr std::int64_t kMeasurementLife_ns = 500'000'000;

/// Thread: any.  RT: not safe.
OperatingState operatingStateOf(const rt::Tick& tick);

/// Whether the position and velocity of the tick's measurement may be published: they are there, finite, and
/// of a device that knows where it is.
bool isMeasured(const rt::Tick& tick);

}  // namespace hapticd::tools::ros
