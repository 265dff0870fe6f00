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
  std::string file;          ///< file name in the recording's folder
  std::int64_t host_ns = 0;  ///< host time since the first depth frame of the recording; never decreases

  /// Host time as given in the file name: CLOCK_REALTIME of the recording host.
  std::int64_t realtime_ns = 0;
  std::uint32_t device_ticks = 0;  ///< the camera's own counter
};

/// The depth frames of a recording in libfreenect's format: a folder with INDEX.txt, which lists one file per
/// line in playback order, `d-<host seconds>-<device ticks>.pgm` for depth. Lines of colour (`r-`) and tilt
/// (`a-`) are ignored. Where the host's clock was set back, the time stands still until the clock catches up.
/// Thread: any; several threads may call read() with separate frames.  RT: not safe.
class RecordingReader {
 public:
  /// Checks the folder, the index and that each depth file exists; read() checks the images.
  /// Errors: name the line of INDEX.txt and the remedy.
  static config::Result<RecordingReader> open(const std::filesystem::path& folder);

  /// Returns all frames; never empty.
  const std::vector<RecordedFrame>& frames() const { return frames_; }
  const std::filesystem::path& folder() const { return folder_; }

  /// Reads frame `index` (below frames().size()). Sets raw, sequence = index + 1, arrival_ns = its host_ns,
  /// and device_ticks.  Errors: see readDepthPgm().
  config::Result<void> read(std::size_t index, rt::DepthFrame& frame) const;

 private:
  RecordingReader(std::filesystem::path folder, std::vector<RecordedFrame> frames)
      : folder_(std::move(folder)), frames_(std::move(frames)) {}

  std::filesystem::path folder_;
  std::vector<RecordedFrame> frames_;
};

}  // namespace hapticd::drivers
