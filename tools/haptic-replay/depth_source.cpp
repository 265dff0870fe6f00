// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/depth_source.h"

#include <algorithm>

#include "drivers/camera/recorded/depth_image.h"

namespace hapticd::tools {

config::Result<DepthSource> DepthSource::open(const std::filesystem::path& path,
                                              const drivers::DepthLimits& limits) {
  DepthSource source;
  std::error_code no_file;
  if (!std::filesystem::exists(path, no_file)) {
    return std::unexpected(config::Error{path.string(), "no such file or folder",
                                         "--depth takes the folder of a recording or one .pgm file"});
  }
  if (!std::filesystem::is_directory(path, no_file)) {
    source.image_ = path;
    return source;
  }
  auto recording = drivers::RecordingReader::open(path, limits);
  if (!recording) return std::unexpected(recording.error());
  source.recording_ = std::move(*recording);
  return source;
}

std::size_t DepthSource::frameAt(std::int64_t time_ns) const {
  if (!recording_) return 0;
  const auto& frames = recording_->frames();
  const auto after = std::upper_bound(
      frames.begin(), frames.end(), time_ns,
      [](std::int64_t time, const drivers::RecordedFrame& frame) { return time < frame.host_ns; });
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - frames.begin() - 1, 0));
}

config::Result<void> DepthSource::read(std::size_t index, rt::DepthFrame& frame) const {
  if (recording_) return recording_->read(index, frame);
  frame.sequence = 1;
  frame.arrival_ns = 0;
  frame.device_ticks = 0;
  return drivers::readKinectImage(image_, frame);
}

}  // namespace hapticd::tools
