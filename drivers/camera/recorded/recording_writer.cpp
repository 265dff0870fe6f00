// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/recording_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "drivers/camera/recorded/depth_pgm.h"
#include "rt/clock.h"

namespace hapticd::drivers {
namespace {

config::Error diskError(const std::filesystem::path& where) {
  return {where.string(), fmt::format("cannot be written: {}", std::strerror(errno)), "check the disk"};
}

/// Returns the file name of a frame in a recording.
std::string nameOf(const rt::DepthFrame& frame, std::int64_t realtime_offset_ns) {
  const std::int64_t realtime_ns = frame.arrival_ns + realtime_offset_ns;
  return fmt::format("d-{}.{:09}-{}.pgm", realtime_ns / rt::kNsPerSecond, realtime_ns % rt::kNsPerSecond,
                     frame.device_ticks);
}

}  // namespace

config::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::filesystem::path& folder,
                                                                         std::int64_t realtime_offset_ns) {
  std::error_code failure;
  if (!std::filesystem::create_directory(folder, failure)) {
    return std::unexpected(
        config::Error{folder.string(), failure ? "cannot be created: " + failure.message() : "already exists",
                      "name a new folder in a writable one"});
  }
  const std::filesystem::path file = folder / "INDEX.txt";
  const int index = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
  if (index < 0) return std::unexpected(diskError(file));
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(folder, index, realtime_offset_ns));
}

RecordingWriter::~RecordingWriter() {
  ::close(index_);
}

/// Writes the image before its index line, so that a reader of the index finds every file named there.
config::Result<void> RecordingWriter::write(const rt::DepthFrame& frame) {
  const std::string name = nameOf(frame, realtime_offset_ns_);
  if (auto image = writeDepthPgm(folder_ / name, frame); !image) return image;
  const std::string line = name + "\n";
  if (::write(index_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    auto error = diskError(folder_ / "INDEX.txt");
    (void)::ftruncate(index_, index_bytes_);  // a partial line would make the index unreadable
    return std::unexpected(std::move(error));
  }
  index_bytes_ += static_cast<std::int64_t>(line.size());
  ++frames_;
  return {};
}

}  // namespace hapticd::drivers
