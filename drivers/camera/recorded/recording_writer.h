// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "config/error.h"
#include "drivers/camera/recorded/growing_index.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Writes a recording of a Kinect v1 in libfreenect's format (see RecordingReader) frame by frame. The host
/// time in a frame's name is its arrival in CLOCK_REALTIME with nanosecond resolution. The recording on disk
/// is readable at any time. Thread: one.  RT: not safe.
class RecordingWriter {
 public:
  /// Creates the folder of a recording, which must not exist yet. `realtime_offset_ns`: CLOCK_REALTIME minus
  /// CLOCK_MONOTONIC.
  /// Errors: the folder cannot be created.
  static config::Result<std::unique_ptr<RecordingWriter>> create(const std::filesystem::path& folder,
                                                                 std::int64_t realtime_offset_ns);
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  /// Appends a frame.  Errors: disk errors; the recording then ends with the previous frame.
  config::Result<void> write(const rt::DepthFrame& frame);

  std::uint64_t frames() const noexcept { return frames_; }  ///< number written

 private:
  RecordingWriter(std::filesystem::path folder, GrowingIndex index, std::int64_t realtime_offset_ns)
      : folder_(std::move(folder)), index_(std::move(index)), realtime_offset_ns_(realtime_offset_ns) {}

  const std::filesystem::path folder_;
  GrowingIndex index_;
  const std::int64_t realtime_offset_ns_;
  std::uint64_t frames_ = 0;
};

}  // namespace hapticd::drivers
