// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "config/error.h"
#include "tests/support/kinect/kinect_protocol.h"

namespace hapticd::test {

/// The first frames of a recording as the camera sends them.  Thread: any, for reading.
class PackedRecording {
 public:
  using Frame = std::span<const std::uint8_t, kinect::kPackedFrameBytes>;

  /// most_frames: at least 1.  Errors: those of the recording; each frame is checked.
  static config::Result<PackedRecording> load(const std::filesystem::path& folder, std::size_t most_frames);

  std::size_t frames() const { return packed_.size() / kinect::kPackedFrameBytes; }
  /// index: below frames().
  Frame frame(std::size_t index) const {
    return std::span(packed_).subspan(index * kinect::kPackedFrameBytes).first<kinect::kPackedFrameBytes>();
  }

 private:
  std::vector<std::uint8_t> packed_;
};

}  // namespace hapticd::test
