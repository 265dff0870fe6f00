// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/watch_summary.h"

#include <fmt/format.h>

#include "tools/hapticctl/status_text.h"

namespace hapticd::tools {

void WatchSummary::add(const Json& reply) {
  if (const Json* status = fieldAt(reply, "status")) status_ = *status;
  // fmin and fmax ignore NaN, which a window without ticks gives
  min_force_n_ = std::fmin(min_force_n_, numberAt(reply, "window.minForceN"));
  max_force_n_ = std::fmax(max_force_n_, numberAt(reply, "window.maxForceN"));
}

std::string WatchSummary::text() const {
  const auto count = [this](const char* path) { return countAt(status_, path); };
  return fmt::format(
      "ticks         {} in {} s, {} overruns, {} skipped periods, {} in contact\n"
      "frames        {} from the camera, {} modelled, {} skipped, the last one of {}\n"
      "force         {}..{} N\n"
      "wake-up       {}\n"
      "compute       {}\n",
      count("loop.counters.ticks"), fixed(numberAt(status_, "uptimeS"), 1), count("loop.counters.overruns"),
      count("loop.counters.skippedPeriods"), count("loop.counters.contactTicks"), count("camera.frames"),
      count("scene.models"), count("scene.skippedFrames"), sceneContentText(status_), fixed(min_force_n_, 2),
      fixed(max_force_n_, 2), latencyText(status_, "loop.wakeupLatency"),
      latencyText(status_, "loop.computeTime"));
}

}  // namespace hapticd::tools
