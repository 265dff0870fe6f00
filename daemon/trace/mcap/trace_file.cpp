// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/trace_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "config/base/held_bytes.h"

namespace hapticd::trace {
namespace {

constexpr mode_t kMode = 0644;

std::string remedyFor(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "make room: delete old traces (hapticctl trace list, trace delete), or set trace.max_folder_mb";
    case EFBIG:
      return "the file size is limited: see ulimit -f and LimitFSIZE=";
    case EACCES:
    case EPERM:
    case EROFS:
      return "check the permissions of the folder and the user";
    case ENOENT:
      return "check the path";
    case EIO:
      return "the disk is failing: check the kernel log";
  }
  return "";
}

std::unexpected<base::Error> systemError(const std::filesystem::path& path, std::string_view doing) {
  const int error = errno;
  return base::failure(path.string(), fmt::format("cannot be {}: {}", doing, std::strerror(error)),
                       remedyFor(error));
}

}  // namespace

base::Result<TraceFile> TraceFile::open(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC, kMode);
  if (descriptor < 0) return systemError(path, (flags & O_CREAT) != 0 ? "created" : "opened");
  return TraceFile(path, descriptor);
}

/// A file system without locks is not a reason to fail.
base::Result<TraceFile> TraceFile::openLocked(const std::filesystem::path& path, int flags) {
  auto file = open(path, flags);
  if (!file || ::flock(file->descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return file;
  return base::failure(path.string(), "is being written", "stop the trace first");
}

base::Result<TraceFile> TraceFile::create(const std::filesystem::path& path) {
  return openLocked(path, O_RDWR | O_CREAT | O_EXCL);
}

base::Result<TraceFile> TraceFile::openToRead(const std::filesystem::path& path) {
  return open(path, O_RDONLY | O_NONBLOCK);  // opening a pipe would wait for its writer
}

base::Result<TraceFile> TraceFile::openToMend(const std::filesystem::path& path) {
  return openLocked(path, O_RDWR);
}

TraceFile::TraceFile(TraceFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      window_(std::move(other.window_)),
      window_at_(other.window_at_) {}

TraceFile::~TraceFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::unexpected<base::Error> TraceFile::failure(std::string_view doing) const {
  return systemError(path_, doing);
}

base::Result<std::uint64_t> TraceFile::size() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) return failure("examined");
  if (!S_ISREG(status.st_mode)) {
    return base::failure(path_.string(), "is not a regular file", "give the path of a trace");
  }
  return static_cast<std::uint64_t>(status.st_size);
}

base::Result<void> TraceFile::writeAt(std::uint64_t offset, std::string_view bytes) {
  window_.clear();
  while (!bytes.empty()) {
    const std::size_t part = std::min(bytes.size(), base::kBytesAtOnce);
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), part, static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failure("written");
    offset += static_cast<std::uint64_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

base::Result<void> TraceFile::readAt(std::uint64_t offset, std::size_t length, std::string& to) const {
  constexpr std::size_t kPageBytes = 1 << 12, kWindowBytes = 1 << 16;
  if (length > kPageBytes) return readFromDisk(offset, length, to);
  const auto isThere = [&] { return offset >= window_at_ && offset + length <= window_at_ + window_.size(); };
  if (!isThere()) {
    const std::uint64_t end = window_at_ + window_.size();
    const bool goes_on = offset >= window_at_ && offset <= end + kPageBytes;
    window_at_ = offset;
    if (auto read = readFromDisk(offset, goes_on ? kWindowBytes : kPageBytes, window_); !read) {
      window_.clear();
      return read;
    }
  }
  to = std::string_view(window_).substr(std::min<std::size_t>(offset - window_at_, window_.size()), length);
  return {};
}

base::Result<void> TraceFile::readFromDisk(std::uint64_t offset, std::size_t length, std::string& to) const {
  to.resize(length);
  std::size_t done = 0;
  while (done < length) {
    const ssize_t got =
        ::pread(descriptor_, to.data() + done, length - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failure("read");
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  to.resize(done);
  return {};
}

base::Result<void> TraceFile::truncate(std::uint64_t size) {
  window_.clear();
  if (::ftruncate(descriptor_, static_cast<off_t>(size)) != 0) return failure("truncated");
  return {};
}

base::Result<void> TraceFile::synchronise() {
  if (::fdatasync(descriptor_) != 0) return failure("written to the disk");
  return {};
}

bool isBeingWritten(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool locked = ::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(descriptor);  // also releases the lock
  return locked;
}

std::filesystem::path partOf(const std::filesystem::path& file) {
  return file.string() + ".part";
}

base::Result<void> synchroniseFolder(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder.empty() ? "." : folder;
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return systemError(path, "opened");
  const bool done = ::fsync(descriptor) == 0;
  const base::Result<void> result = done ? base::Result<void>{} : systemError(path, "written to the disk");
  ::close(descriptor);
  return result;
}

base::Result<void> renameDurably(const std::filesystem::path& part, const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    return base::failure(part.string(), fmt::format("{} already exists", file.string()),
                         "rename or delete one of them");
  }
  if (::rename(part.c_str(), file.c_str()) != 0) return systemError(part, "renamed");
  return synchroniseFolder(file.parent_path());
}

}  // namespace hapticd::trace
