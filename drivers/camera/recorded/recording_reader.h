// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/error.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// One depth frame of a recording.
struct RecordedFrame {
  std::string file;          ///< its name in the recording's folder
  std::int64_t host_ns = 0;  ///< host time since the recording's first depth frame; never decreases
  std::int64_t realtime_ns =
      0;  ///< the same, as it stands in the name: CLOCK_REALTIME, where that was recorded
  std::uint32_t device_ticks = 0;  ///< the camera's own counter
};

/// The depth frames of a recording in libfreenect's format: a folder with INDEX.txt, which names a file per
/// line in the order of playback, `d-<host seconds>-<device ticks>.pgm` for depth. Lines of colour (`r-`) and
/// tilt (`a-`) are left out. Where the host's clock was set back, time stands still until it catches up.
/// Thread: any; read() may be called from several threads with frames of their own.  RT: not safe.
class RecordingReader {
 public:
  /// Checks the folder, the index and that each depth file exists; the images are checked by read().
  /// Errors: what is wrong, with the line of INDEX.txt and what to do about it.
  static config::Result<RecordingReader> open(const std::filesystem::path& folder);

  /// Never empty.
  const std::vector<RecordedFrame>& frames() const { return frames_; }
  const std::filesystem::path& folder() const { return folder_; }

  /// Reads frame `index` (below frames().size()): raw; sequence = index + 1; arrival_ns = its host_ns;
  /// device_ticks.  Errors: those of readDepthPgm().
  config::Result<void> read(std::size_t index, rt::DepthFrame& frame) const;

 private:
  RecordingReader(std::filesystem::path folder, std::vector<RecordedFrame> frames)
      : folder_(std::move(folder)), frames_(std::move(frames)) {}

  std::filesystem::path folder_;
  std::vector<RecordedFrame> frames_;
};

}  // namespace hapticd::drivers
