// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "daemon/base/names.h"
#include "rt/words.h"

namespace hapticd::daemon {

/// A fault that can be made up; a script calls it by its word.
enum class Fault {
  lost_frames,       ///< every second frame of the camera is dropped
  frozen_camera,     ///< no frame comes any more
  garbage_depth,     ///< frames of random values
  handle_muted,      ///< no measurement of the handle comes any more
  handle_unplugged,  ///< the same, and it comes back as another session
  handle_leap,       ///< positions half a metre away
  nan_pose,          ///< positions that are not numbers
  late_ticks,        ///< every second tick takes 3 ms longer
  channel_overflow,  ///< nobody takes the ticks out of their ring
};
constexpr auto wordsOf(Fault) {
  return rt::words<Fault>("lost_frames", "frozen_camera", "garbage_depth", "handle_muted", "handle_unplugged",
                          "handle_leap", "nan_pose", "late_ticks", "channel_overflow");
}
inline constexpr int kFaultCount = static_cast<int>(rt::enumeratorCount<Fault>());

/// When a fault begins and how long it lasts, since the start of the box.
struct ScriptedFault {
  Fault fault;
  std::chrono::duration<double> begin;
  std::chrono::duration<double> duration;
};

/// Reads a script: lines of "BEGIN_S DURATION_S FAULT", `#` begins a comment.
/// Errors: a file that cannot be read, a line that is none of these (with its number).
config::Result<std::vector<ScriptedFault>> readFaultScript(const std::filesystem::path& file);

}  // namespace hapticd::daemon
