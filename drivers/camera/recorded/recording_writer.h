#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "config/error.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Writes a recording in libfreenect's format (RecordingReader), frame by frame on a thread of its own. The
/// host time in a frame's name is its arrival in CLOCK_REALTIME, to the nanosecond; at any moment the
/// recording on the disk can be read.
class RecordingWriter {
 public:
  /// `folder` does not exist yet. `realtime_offset_ns`: CLOCK_REALTIME minus CLOCK_MONOTONIC.
  /// Errors: the folder cannot be made, no thread.
  static config::Result<std::unique_ptr<RecordingWriter>> create(const std::filesystem::path& folder,
                                                                 std::int64_t realtime_offset_ns);
  /// Like close().
  ~RecordingWriter();
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  /// Takes a copy of the frame. False, and one more in lost(), when the disk is too slow or has failed.
  /// Thread: one.  Never blocks longer than copying takes.
  bool offer(const rt::DepthFrame& frame);

  /// Writes what was taken and ends the thread. offer() is not called any more.
  /// Errors: failure().
  config::Result<void> close();

  // Thread: any.
  std::uint64_t frames() const noexcept;         ///< written
  std::uint64_t lost() const noexcept;           ///< refused
  std::optional<config::Error> failure() const;  ///< why no more are written; nothing: all is well

 private:
  class Implementation;
  explicit RecordingWriter(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hapticd::drivers
