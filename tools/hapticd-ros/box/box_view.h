// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "daemon/trace/ros/message_set.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::ros {

using trace::ros::FixedFrame;

/// The parameters that say where the handle's frame is.
Json handleFrameParameters();

/// The frames of camera and handle in the world, and the optical frame of the camera in its own: x right, y
/// down, z forward, as images and clouds of ROS 2 have it; as far as the replies tell: a member that is
/// missing or no number leaves its frame out. calibration: reply of GetCalibration; parameters: of
/// GetParameters with those above; prefix: of the names of the frames, "hapticd/".
std::vector<FixedFrame> fixedFrames(const Json& calibration, const Json& parameters,
                                    const std::string& prefix);

using trace::ros::Diagnostic;

/// The bridge's own counters, since its start.
struct BridgeCounters {
  std::uint64_t messages = 0;         ///< written
  std::uint64_t messages_failed = 0;  ///< that could not be written
  std::uint64_t ticks_lost = 0;       ///< that hapticd could not hand over in time
  std::uint64_t ticks_late = 0;       ///< not published, because they were too old when they came
};

/// One entry for the box, its force loop, camera and handle, and the bridge.
/// status: of io.hapticd.Status; null: hapticd does not answer, for the reason `problem`.
/// name_space: begins the names.
std::vector<Diagnostic> diagnosticsOf(const Json& status, const std::string& problem,
                                      const BridgeCounters& counters, const std::string& name_space);

/// A running hapticd: the stream of its ticks, and calls beside it. Every wait has a time limit, and ends
/// when the descriptor for interruption becomes readable. Thread: one at a time.
class BoxLink {
 public:
  /// rate_hz: of the ticks, 1..1000; ticks in which the mode, the buttons or the handle's condition change
  /// come in addition.
  static ClientResult<BoxLink> open(const std::string& socket, int rate_hz, int interrupt);

  /// The next reply of io.hapticd.Status.Ticks, with the fields that hapticd-ros reads.
  ClientResult<Json> nextTicks() { return ticks_.next(kSilence); }
  /// Of the interface io.hapticd.Status.
  ClientResult<Json> call(const std::string& method, const Json& parameters = Json::object());

 private:
  /// After which hapticd hangs: ticks come in batches without end, and calls are answered at once.
  static constexpr std::chrono::milliseconds kSilence{3000};

  BoxLink(VarlinkClient ticks, VarlinkClient calls) : ticks_(std::move(ticks)), calls_(std::move(calls)) {}

  VarlinkClient ticks_;
  VarlinkClient calls_;
};

}  // namespace hapticd::tools::ros
