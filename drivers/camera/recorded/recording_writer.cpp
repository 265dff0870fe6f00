// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/recording_writer.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "drivers/camera/recorded/depth_image.h"
#include "rt/clock.h"

namespace hapticd::drivers {
namespace {

/// Returns the file name of a frame in a recording.
std::string nameOf(const rt::DepthFrame& frame, std::int64_t realtime_offset_ns) {
  const std::int64_t realtime_ns = frame.arrival_ns + realtime_offset_ns;
  return fmt::format("d-{}.{:09}-{}.pgm", realtime_ns / rt::kNsPerSecond, realtime_ns % rt::kNsPerSecond,
                     frame.device_ticks);
}

}  // namespace

config::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::filesystem::path& folder,
                                                                         std::int64_t realtime_offset_ns) {
  auto index = GrowingIndex::create(folder, "INDEX.txt");
  if (!index) return std::unexpected(index.error());
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(folder, std::move(*index), realtime_offset_ns));
}

/// Writes the image before its index line, so that a reader of the index finds every file named there.
config::Result<void> RecordingWriter::write(const rt::DepthFrame& frame) {
  const std::string name = nameOf(frame, realtime_offset_ns_);
  if (auto image = writeKinectImage(folder_ / name, frame); !image) return image;
  if (auto listed = index_.append(name + "\n"); !listed) return listed;
  ++frames_;
  return {};
}

}  // namespace hapticd::drivers
