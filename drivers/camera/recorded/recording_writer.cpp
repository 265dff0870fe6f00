// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/recording_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

#include "drivers/camera/recorded/depth_image.h"
#include "drivers/camera/recorded/frame_list.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

base::Error diskError(const std::filesystem::path& where) {
  return {where.string(), fmt::format("cannot be written: {}", std::strerror(errno)), "check the disk"};
}

}  // namespace

base::Result<GrowingIndex> GrowingIndex::create(const std::filesystem::path& folder, std::string_view name) {
  std::error_code failure;
  if (!std::filesystem::create_directory(folder, failure)) {
    return std::unexpected(base::Error{folder.string(),
                                       failure ? "cannot be created: " + failure.message() : "already exists",
                                       "name a new folder in a writable one"});
  }
  std::filesystem::path file = folder / name;
  base::Descriptor index(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666));
  if (!index) return std::unexpected(diskError(file));
  return GrowingIndex(std::move(file), std::move(index));
}

base::Result<void> GrowingIndex::append(std::string_view line) {
  if (::write(index_.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    auto error = diskError(file_);
    (void)::ftruncate(index_.get(), bytes_);  // a partial line would make the index unreadable
    return std::unexpected(std::move(error));
  }
  bytes_ += static_cast<std::int64_t>(line.size());
  return {};
}

namespace {

/// Returns the file name of a frame in a recording.
std::string nameOf(const rt::DepthFrame& frame, std::int64_t realtime_offset_ns) {
  const std::int64_t realtime_ns = frame.arrival_ns + realtime_offset_ns;
  return fmt::format("d-{}.{:09}-{}.pgm", realtime_ns / rt::kNsPerSecond, realtime_ns % rt::kNsPerSecond,
                     frame.device_ticks);
}

}  // namespace

base::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::filesystem::path& folder,
                                                                       std::int64_t realtime_offset_ns) {
  auto index = GrowingIndex::create(folder, "INDEX.txt");
  if (!index) return std::unexpected(index.error());
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(folder, std::move(*index), realtime_offset_ns));
}

/// Writes the image before its index line, so that a reader of the index finds every file named there.
base::Result<void> RecordingWriter::write(const rt::DepthFrame& frame) {
  const std::string name = nameOf(frame, realtime_offset_ns_);
  if (auto image = writeKinectImage(folder_ / name, frame); !image) return image;
  if (auto listed = index_.append(name + "\n"); !listed) return listed;
  ++frames_;
  return {};
}

base::Result<std::unique_ptr<CameraRecordingWriter>> CameraRecordingWriter::create(
    const std::filesystem::path& folder, const CameraDescription& description,
    std::int64_t realtime_offset_ns, bool poses) {
  auto index = GrowingIndex::create(folder, kFrameFile);
  if (!index) return std::unexpected(index.error());
  const std::filesystem::path file = folder / kCameraFile;
  std::ofstream camera(file, std::ios::binary);
  camera << textOf(description) << std::flush;
  if (!camera)
    return std::unexpected(base::Error{file.string(), "cannot be written completely", "check the disk"});
  if (auto begun = index->append(frameListHeader(poses)); !begun) return std::unexpected(begun.error());
  return std::unique_ptr<CameraRecordingWriter>(
      new CameraRecordingWriter(folder, std::move(*index), description, realtime_offset_ns, poses));
}

base::Result<void> CameraRecordingWriter::write(const rt::DepthFrame& frame) {
  rt::DepthModelParameters camera = frame.camera;
  camera.near_m = camera_.near_m;
  camera.far_m = camera_.far_m;
  if (camera != camera_) {
    return std::unexpected(
        base::Error{folder_.string(),
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

base::Result<void> CameraRecordingWriter::list(const RecordedFrame& frame) {
  if (frame.realtime_ns <= newest_ns_) {
    return std::unexpected(base::Error{
        folder_.string(), fmt::format("frame {} is not after the frame before", frames_ + 1), ""});
  }
  if (auto listed = index_.append(frameListLine(frame, poses_)); !listed) return listed;
  newest_ns_ = frame.realtime_ns;
  ++frames_;
  return {};
}

}  // namespace hapticd::drivers
