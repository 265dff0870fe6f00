// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/base/status_board.h"
#include "drivers/camera/camera.h"

namespace hapticd::drivers {

/// A camera's status board, with the counting of frames that all cameras share.
/// Thread: any.  Progress: blocking, for as long as a string is copied.  RT: not safe.
class CameraStatusBoard : public StatusBoard<CameraStatus> {
 public:
  void setIdentity(std::string identity) {
    update([&](CameraStatus& status) { status.identity = std::move(identity); });
  }

  void setAdvice(std::string advice) {
    update([&](CameraStatus& status) { status.advice = std::move(advice); });
  }

  /// Counts a published frame; a camera that delivers is streaming. Returns the frame's number, 1 for the
  /// first.
  std::uint64_t countFrame() {
    return update([](CameraStatus& status) {
      if (status.state != CameraState::streaming) {
        status.state = CameraState::streaming;
        if (!status.detail.starts_with(kDamage)) status.detail.clear();
      }
      return ++status.frames;
    });
  }

  /// Counts a frame that was not published because of `why`.
  void countDamagedFrame(std::string why) {
    update([&](CameraStatus& status) {
      ++status.damaged_frames;
      status.detail = std::string(kDamage) + std::move(why);
    });
  }

  /// Counts frames that are missing before one that arrived. `detail`: for people
  void countLostFrames(std::uint32_t count, std::string detail) {
    update([&](CameraStatus& status) {
      status.lost_frames += count;
      status.detail = std::move(detail);
    });
  }

 private:
  static constexpr std::string_view kDamage = "the last damaged frame: ";
};

}  // namespace hapticd::drivers
