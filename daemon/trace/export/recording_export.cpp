// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/export/recording_export.h"

#include <algorithm>
#include <memory>
#include <system_error>
#include <utility>

#include "daemon/trace/export/selected_trace.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/messages.h"
#include "drivers/camera/recorded/recording_writer.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;

std::unexpected<base::Error> refuse(const fs::path& where, std::string what, std::string remedy) {
  return std::unexpected(base::Error{where.string(), std::move(what), std::move(remedy)});
}

fs::path draftOf(const fs::path& folder) {
  return folder.string() + ".part";
}

base::Result<void> mayBegin(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder, ignored)) return refuse(folder, "exists already", "name a new folder with --out");
  if (fs::exists(draftOf(folder), ignored)) {
    return refuse(draftOf(folder), "exists: an export is at work, or was cut off",
                  "wait for it, or delete it");
  }
  return {};
}

/// Whether frames of the camera are what libfreenect's format holds.
bool isKinect(const rt::DepthModelParameters& camera) {
  const rt::DepthModelParameters kinect;
  return camera.law == kinect.law && camera.width_px == kinect.width_px &&
         camera.height_px == kinect.height_px && camera.raw_values == kinect.raw_values &&
         camera.raw_no_measurement == kinect.raw_no_measurement;
}

/// Writes frames in the format of the first one's camera.
class FolderWriter {
 public:
  FolderWriter(fs::path folder, std::int64_t realtime_offset_ns)
      : folder_(std::move(folder)), realtime_offset_ns_(realtime_offset_ns) {}

  base::Result<void> write(const rt::DepthFrame& frame, std::string serial) {
    if (frames_ == 0) {
      if (auto begun = begin(frame, std::move(serial)); !begun) return begun;
    }
    ++frames_;
    if (of_camera_) return of_camera_->write(frame);
    if (isKinect(frame.camera)) return of_kinect_->write(frame);
    return refuse(folder_, "the trace is of a Kinect v1 at first and then of another camera",
                  "choose the stretch of one camera with --from and --to");
  }
  std::uint64_t frames() const { return frames_; }

 private:
  base::Result<void> begin(const rt::DepthFrame& frame, std::string serial) {
    if (isKinect(frame.camera)) {
      auto writer = drivers::RecordingWriter::create(folder_, realtime_offset_ns_);
      if (!writer) return std::unexpected(writer.error());
      of_kinect_ = std::move(*writer);
      return {};
    }
    const drivers::CameraDescription description{
        .camera = frame.camera, .near_m = {}, .far_m = {}, .serial = std::move(serial)};
    auto writer = drivers::CameraRecordingWriter::create(folder_, description, realtime_offset_ns_);
    if (!writer) return std::unexpected(writer.error());
    of_camera_ = std::move(*writer);
    return {};
  }

  fs::path folder_;
  std::int64_t realtime_offset_ns_;
  std::unique_ptr<drivers::RecordingWriter> of_kinect_;
  std::unique_ptr<drivers::CameraRecordingWriter> of_camera_;
  std::uint64_t frames_ = 0;
};

std::string serialOf(const rt::DepthFrameHeader& header) {
  return {header.serial.begin(), std::ranges::find(header.serial, 0)};
}

/// Writes the content of the folder.
base::Result<std::uint64_t> writeFrames(const SelectedTrace& trace, const fs::path& file,
                                        const fs::path& draft, const Progress& progress) {
  FolderWriter writer(draft, trace.realtimeOffset_ns());
  DepthDecoder decoder;
  const auto frame = std::make_unique<rt::DepthFrame>();
  base::Result<void> written;
  const auto write = [&](const DepthRecord& record) {
    const std::string wrong = decoder.decode(record, *frame);
    written = wrong.empty() ? writer.write(*frame, serialOf(record.header)) : refuse(file, wrong, "");
    return written.has_value();
  };
  const auto info = trace.readAll({.depth = write}, progress);
  if (!written) return std::unexpected(written.error());
  if (!info) return std::unexpected(info.error());
  if (!info->topics.contains(kChannelName<DepthRecord>.topic)) {
    return refuse(file, "holds no depth", "write it with depth: hapticctl trace start --depth");
  }
  if (writer.frames() == 0) {
    return refuse(file, "holds no depth in that time", "choose another stretch with --from and --to");
  }
  return writer.frames();
}

}  // namespace

base::Result<std::uint64_t> exportRecording(const fs::path& trace, const fs::path& folder,
                                            const TraceSelection& selection, const Progress& progress) {
  const auto selected = SelectedTrace::open(trace, selection);
  if (!selected) return std::unexpected(selected.error());
  if (auto possible = mayBegin(folder); !possible) return std::unexpected(possible.error());
  const fs::path draft = draftOf(folder);
  auto frames = writeFrames(*selected, trace, draft, progress);
  std::error_code failure;
  if (frames) fs::rename(draft, folder, failure);
  if (frames && !failure) return frames;
  std::error_code ignored;
  fs::remove_all(draft, ignored);
  if (!frames) return frames;
  return refuse(folder, "cannot be created: " + failure.message(), "name a new folder with --out");
}

}  // namespace hapticd::trace
