// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "daemon/base/names.h"
#include "rt/base/words.h"

namespace hapticd::daemon {

/// A fault that can be injected; scripts name it by its word.
enum class Fault {
  lost_frames,       ///< every second frame of the camera is dropped
  frozen_camera,     ///< no more frames arrive
  garbage_depth,     ///< frames contain random values
  handle_muted,      ///< no more measurements of the handle arrive
  handle_unplugged,  ///< likewise, and the handle returns with a new session
  handle_leap,       ///< positions half a metre away
  nan_pose,          ///< positions that are not numbers
  late_ticks,        ///< every second tick takes 3 ms longer
  channel_overflow,  ///< nobody reads the ticks from their ring
};
constexpr auto wordsOf(Fault) {
  return rt::words<Fault>("lost_frames", "frozen_camera", "garbage_depth", "handle_muted", "handle_unplugged",
                          "handle_leap", "nan_pose", "late_ticks", "channel_overflow");
}
inline constexpr int kFaultCount = static_cast<int>(rt::enumeratorCount<Fault>());

/// When a fault starts, counted from the start of the box, and how long it lasts.
struct ScriptedFault {
  Fault fault;
  std::chrono::duration<double> begin;
  std::chrono::duration<double> duration;
};

/// Reads a script: lines of "BEGIN_S DURATION_S FAULT", `#` begins a comment.
/// Errors: a file that cannot be read, a line of another form (with its number).
base::Result<std::vector<ScriptedFault>> readFaultScript(const std::filesystem::path& file);

}  // namespace hapticd::daemon
