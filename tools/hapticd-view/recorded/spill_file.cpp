// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/recorded/spill_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace hapticd::tools::view {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr const char* kRemedy = "free space there, or name another folder in the variable TMPDIR";

std::string folder() {
  const char* const named = std::getenv("TMPDIR");
  return named != nullptr && *named != '\0' ? named : "/var/tmp";
}

std::unexpected<config::Error> failure(const char* doing) {
  const std::string what = std::string(doing) + ": " + std::strerror(errno);
  return std::unexpected(config::Error{"temporary file in " + folder(), what, kRemedy});
}

}  // namespace

config::Result<SpillFile> SpillFile::create() {
  config::Descriptor file(::open(folder().c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (!file) return failure("cannot be made");
  return SpillFile(std::move(file));
}

SpillFile::SpillFile(SpillFile&& other) noexcept
    : file_(std::move(other.file_)),
      buffer_(std::move(other.buffer_)),
      written_(other.written_),
      mapped_(std::exchange(other.mapped_, nullptr)),
      mapped_bytes_(std::exchange(other.mapped_bytes_, 0)) {}

SpillFile::~SpillFile() {
  if (mapped_ != nullptr) ::munmap(mapped_, mapped_bytes_);
}

config::Result<void> SpillFile::append(std::span<const std::byte> bytes) {
  buffer_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return buffer_.size() < kBufferBytes ? config::Result<void>() : flush();
}

config::Result<void> SpillFile::flush() {
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t count = ::write(file_.get(), buffer_.data() + done, buffer_.size() - done);
    if (count < 0 && errno != EINTR) return failure("cannot be written");
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  written_ += buffer_.size();
  buffer_.clear();
  return {};
}

config::Result<void> SpillFile::map() {
  if (const auto flushed = flush(); !flushed) return flushed;
  if (written_ == 0) return {};
  void* const mapped = ::mmap(nullptr, written_, PROT_READ, MAP_SHARED, file_.get(), 0);
  if (mapped == MAP_FAILED) return failure("cannot be mapped");
  mapped_ = static_cast<std::byte*>(mapped);
  mapped_bytes_ = written_;
  return {};
}

}  // namespace hapticd::tools::view
