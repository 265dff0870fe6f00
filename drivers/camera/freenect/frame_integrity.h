// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace hapticd::drivers {

/// Determines from libfreenect's log whether the next depth frame that it delivers is complete. libfreenect
/// delivers a frame with up to five lost packets without notice, leaving older data in the gaps; only its log
/// mentions them: "[Stream 70] Lost n packets" and short packets while the frame arrives, and (at level SPEW)
/// "Got depth frame of size ..., a/b packets arrived" right before the frame's callback. The packet count
/// takes precedence, because a loss may belong to a frame that was abandoned.
/// Thread: the one that calls libfreenect.
class FrameIntegrity {
 public:
  /// Processes one line of libfreenect's log.
  void noteLogLine(std::string_view line);

  /// Called once per delivered frame; returns why it is damaged, or nothing if it is complete.
  std::optional<std::string> takeDamage();

 private:
  std::string loss_;                // newest line about data missing in the frame in progress
  std::string count_;               // packet count of the frame about to be delivered
  bool count_is_complete_ = false;  // a == b
};

}  // namespace hapticd::drivers
