// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace hapticd::drivers {

/// Learns from libfreenect's log whether the depth frame that it delivers next is whole. libfreenect hands on
/// a frame with up to five lost packets as if nothing were missing, with older data in the holes; only its
/// log tells: "[Stream 70] Lost n packets" and short packets while the frame arrives, and (level SPEW) "Got
/// depth frame of size ..., a/b packets arrived" right before the frame's callback. The count decides where
/// there is one, since a loss may also belong to a frame that was given up.
/// Thread: the one that calls libfreenect.
class FrameIntegrity {
 public:
  void noteLogLine(std::string_view line);

  /// To be called once per delivered frame: why it is damaged, or nothing if it is whole.
  std::optional<std::string> takeDamage();

 private:
  std::string loss_;                // the newest line about data missing in the frame in progress
  std::string count_;               // "a/b packets arrived" of the frame about to be delivered
  bool count_is_complete_ = false;  // a == b
};

}  // namespace hapticd::drivers
