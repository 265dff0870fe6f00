// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "config/error.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "rt/depth_frame.h"

namespace hapticd::tools {

/// The depth frames of a recording, or a single depth frame that is used at all times.
class DepthSource {
 public:
  /// `path`: the folder of a recording, or a .pgm file as libfreenect's recorder writes it. `limits`:
  /// accepted depths of a camera that the recording describes.
  static config::Result<DepthSource> open(const std::filesystem::path& path,
                                          const drivers::DepthLimits& limits = {});

  /// Index (from 0) of the newest frame that had arrived at `time_ns` >= 0, since the first frame; 0 for a
  /// single image.
  std::size_t frameAt(std::int64_t time_ns) const;
  /// Whether it is a single image, which counts as just arrived at any time. The frames of a recording have
  /// their arrival since the first one.
  bool isImage() const { return !recording_; }
  /// Returns the camera that the recording describes; nothing for a Kinect v1.
  std::optional<rt::DepthModelParameters> camera() const {
    return recording_ ? recording_->camera() : std::nullopt;
  }
  config::Result<void> read(std::size_t index, rt::DepthFrame& frame) const;
  std::size_t frames() const { return recording_ ? recording_->frames().size() : 1; }
  /// Why the last line of the recording's index was left out; empty: it was not.
  std::string cutOff() const { return recording_ ? recording_->cutOff() : ""; }

 private:
  DepthSource() = default;

  std::optional<drivers::RecordingReader> recording_;
  std::filesystem::path image_;
};

}  // namespace hapticd::tools
