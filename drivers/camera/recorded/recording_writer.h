// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>

#include "config/base/descriptor.h"
#include "config/base/error.h"
#include "drivers/camera/recorded/camera_description.h"
#include "drivers/camera/recorded/frame_list.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// The index of a recording that is being written, in its new folder. It consists of whole lines at any time.
/// Thread: one.  RT: not safe.
class GrowingIndex {
 public:
  /// Creates the folder of a recording, which must not exist yet, and an empty index in it.
  /// Errors: the folder or the file cannot be created.
  static base::Result<GrowingIndex> create(const std::filesystem::path& folder, std::string_view name);

  /// Appends a line, which includes its end.
  /// Errors: disk errors; the index then ends with the previous line.
  base::Result<void> append(std::string_view line);

 private:
  GrowingIndex(std::filesystem::path file, base::Descriptor index)
      : file_(std::move(file)), index_(std::move(index)) {}

  std::filesystem::path file_;
  base::Descriptor index_;
  std::int64_t bytes_ = 0;  ///< length of the complete lines
};

/// Writes a recording of a Kinect v1 in libfreenect's format (see RecordingReader) frame by frame. The host
/// time in a frame's name is its arrival in CLOCK_REALTIME with nanosecond resolution. The recording on disk
/// is readable at any time. Thread: one.  RT: not safe.
class RecordingWriter {
 public:
  /// Creates the folder of a recording, which must not exist yet. `realtime_offset_ns`: CLOCK_REALTIME minus
  /// CLOCK_MONOTONIC.
  /// Errors: the folder cannot be created.
  static base::Result<std::unique_ptr<RecordingWriter>> create(const std::filesystem::path& folder,
                                                               std::int64_t realtime_offset_ns);
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  /// Appends a frame.  Errors: disk errors; the recording then ends with the previous frame.
  base::Result<void> write(const rt::DepthFrame& frame);

  std::uint64_t frames() const noexcept { return frames_; }  ///< number written

 private:
  RecordingWriter(std::filesystem::path folder, GrowingIndex index, std::int64_t realtime_offset_ns)
      : folder_(std::move(folder)), index_(std::move(index)), realtime_offset_ns_(realtime_offset_ns) {}

  const std::filesystem::path folder_;
  GrowingIndex index_;
  const std::int64_t realtime_offset_ns_;
  std::uint64_t frames_ = 0;
};

/// Writes a recording of any camera, with camera.yaml and frames.csv (see RecordingReader), frame by frame.
/// From the first frame on, the recording on disk is readable at any time.
/// Thread: one.  RT: not safe.
class CameraRecordingWriter {
 public:
  /// Creates the folder of a recording, which must not exist yet. `realtime_offset_ns`: CLOCK_REALTIME minus
  /// CLOCK_MONOTONIC. `poses`: frames may have poses.
  /// Errors: the folder cannot be created.
  static base::Result<std::unique_ptr<CameraRecordingWriter>> create(const std::filesystem::path& folder,
                                                                     const CameraDescription& description,
                                                                     std::int64_t realtime_offset_ns,
                                                                     bool poses = false);
  CameraRecordingWriter(const CameraRecordingWriter&) = delete;
  CameraRecordingWriter& operator=(const CameraRecordingWriter&) = delete;

  /// Appends a frame as a PGM image, at its arrival in CLOCK_REALTIME, which is after that of the frame
  /// before.
  /// Errors: the frame is of another camera (near_m and far_m do not count), or not after the one before;
  /// disk errors. The recording then ends with the previous frame.
  base::Result<void> write(const rt::DepthFrame& frame);

  /// Appends a frame whose image the caller has put into the folder.  Errors: as write().
  base::Result<void> list(const RecordedFrame& frame);

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
