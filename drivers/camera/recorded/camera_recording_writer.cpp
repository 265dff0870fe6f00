// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/camera_recording_writer.h"

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <utility>

#include "drivers/camera/recorded/depth_image.h"
#include "drivers/camera/recorded/frame_list.h"

namespace hapticd::drivers {

config::Result<std::unique_ptr<CameraRecordingWriter>> CameraRecordingWriter::create(
    const std::filesystem::path& folder, const CameraDescription& description,
    std::int64_t realtime_offset_ns, bool poses) {
  auto index = GrowingIndex::create(folder, kFrameFile);
  if (!index) return std::unexpected(index.error());
  const std::filesystem::path file = folder / kCameraFile;
  std::ofstream camera(file, std::ios::binary);
  camera << textOf(description) << std::flush;
  if (!camera)
    return std::unexpected(config::Error{file.string(), "cannot be written completely", "check the disk"});
  if (auto begun = index->append(frameListHeader(poses)); !begun) return std::unexpected(begun.error());
  return std::unique_ptr<CameraRecordingWriter>(
      new CameraRecordingWriter(folder, std::move(*index), description, realtime_offset_ns, poses));
}

config::Result<void> CameraRecordingWriter::write(const rt::DepthFrame& frame) {
  rt::DepthModelParameters camera = frame.camera;
  camera.near_m = camera_.near_m;
  camera.far_m = camera_.far_m;
  if (camera != camera_) {
    return std::unexpected(config::Error{
        folder_.string(),
        fmt::format("frame {} is of another camera or mode than those before", frame.sequence),
        "a recording is of one camera in one mode; take the frames before or after the change"});
  }
  RecordedFrame recorded;
  recorded.file = fmt::format("depth-{:06}.pgm", frames_ + 1);
  recorded.realtime_ns = frame.arrival_ns + realtime_offset_ns_;
  recorded.device_ticks = frame.device_ticks;
  if (frame.exposure_ns != 0) recorded.exposure_ns = frame.exposure_ns + realtime_offset_ns_;
  if (auto image = writeDepthImage(folder_ / recorded.file, frame); !image) return image;
  return list(recorded);
}

config::Result<void> CameraRecordingWriter::list(const RecordedFrame& frame) {
  if (frame.realtime_ns <= newest_ns_) {
    return std::unexpected(config::Error{
        folder_.string(), fmt::format("frame {} is not after the frame before", frames_ + 1), ""});
  }
  if (auto listed = index_.append(frameListLine(frame, poses_)); !listed) return listed;
  newest_ns_ = frame.realtime_ns;
  ++frames_;
  return {};
}

}  // namespace hapticd::drivers
