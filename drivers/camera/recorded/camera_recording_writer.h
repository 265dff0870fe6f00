// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "config/error.h"
#include "drivers/camera/recorded/camera_description.h"
#include "drivers/camera/recorded/growing_index.h"
#include "drivers/camera/recorded/recorded_frame.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Writes a recording of any camera, with camera.yaml and frames.csv (see RecordingReader), frame by frame.
/// From the first frame on, the recording on disk is readable at any time.
/// Thread: one.  RT: not safe.
class CameraRecordingWriter {
 public:
  /// Creates the folder of a recording, which must not exist yet. `realtime_offset_ns`: CLOCK_REALTIME minus
  /// CLOCK_MONOTONIC. `poses`: frames may have poses.
  /// Errors: the folder cannot be created.
  static config::Result<std::unique_ptr<CameraRecordingWriter>> create(const std::filesystem::path& folder,
                                                                       const CameraDescription& description,
                                                                       std::int64_t realtime_offset_ns,
                                                                       bool poses = false);
  CameraRecordingWriter(const CameraRecordingWriter&) = delete;
  CameraRecordingWriter& operator=(const CameraRecordingWriter&) = delete;

  /// Appends a frame as a PGM image, at its arrival in CLOCK_REALTIME, which is after that of the frame
  /// before.
  /// Errors: the frame is of another camera (near_m and far_m do not count), or not after the one before;
  /// disk errors. The recording then ends with the previous frame.
  config::Result<void> write(const rt::DepthFrame& frame);

  /// Appends a frame whose image the caller has put into the folder.  Errors: as write().
  config::Result<void> list(const RecordedFrame& frame);

  std::uint64_t frames() const noexcept { return frames_; }  ///< number written

 private:
  CameraRecordingWriter(std::filesystem::path folder, GrowingIndex index,
                        const CameraDescription& description, std::int64_t realtime_offset_ns, bool poses)
      : folder_(std::move(folder)),
        index_(std::move(index)),
        camera_(description.camera),
        realtime_offset_ns_(realtime_offset_ns),
        poses_(poses) {}

  std::filesystem::path folder_;
  GrowingIndex index_;
  rt::DepthModelParameters camera_;
  std::int64_t realtime_offset_ns_;
  bool poses_;
  std::uint64_t frames_ = 0;
  std::int64_t newest_ns_ = -1;  ///< realtime_ns of the previous frame
};

}  // namespace hapticd::drivers
