// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/words.h"

namespace hapticd::config {

/// What an event of the daemon is about. The daemon writes its word to the journal's field HAPTICD_EVENT, to
/// traces and to the method Events, and clients select events by it.
enum class EventKind {
  mode,
  camera,
  handle,
  warning,  ///< its field STATE is "begin" or "end"
  engage,
  disengage,
  clear_fault,
  parameter,
  profile,
  calibration,
  trace,
  mark,  ///< of an experimenter, whose text is in the field MARK
  configuration,
  reload,
  stop,
  fixture,  ///< a virtual fixture was added, changed, enabled, disabled or removed
  region,   ///< a tissue region likewise, or an estimator began to feed it
  breach,   ///< the HIP has been inside a forbidden region
  frame,    ///< a moving frame was lost, came back or jumped, or its rules were changed
  force,    ///< another program began to feed forces
};

constexpr auto wordsOf(EventKind) {
  return rt::words<EventKind>("mode", "camera", "handle", "warning", "engage", "disengage", "clear_fault",
                              "parameter", "profile", "calibration", "trace", "mark", "configuration",
                              "reload", "stop", "fixture", "region", "breach", "frame", "force");
}

}  // namespace hapticd::config
