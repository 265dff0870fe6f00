// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/state_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

/// " (process 123)"; empty if the file contains no process ID.
std::string holderOf(int file) {
  std::array<char, 32> text{};
  const ssize_t length = ::pread(file, text.data(), text.size(), 0);
  if (length <= 0) return "";
  long process = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + length, process);
  return failure == std::errc() && process > 0 ? fmt::format(" (process {})", process) : "";
}

/// Writes the process ID for people, and for the error message of another process; the lock does not depend
/// on it.
void writeHolder(int file) {
  const std::string text = fmt::format("{}\n", ::getpid());
  if (::ftruncate(file, 0) != 0) return;
  [[maybe_unused]] const ssize_t ignored = ::pwrite(file, text.data(), text.size(), 0);
}

/// Only the daemon's user may open the file: anyone who may read it could lock it and prevent hapticd from
/// starting.
config::Descriptor openFile(const fs::path& file) {
  constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  config::Descriptor writable(::open(file.c_str(), O_RDWR | O_CREAT | kFlags, 0600));
  return writable ? std::move(writable) : config::Descriptor(::open(file.c_str(), O_RDONLY | kFlags));
}

}  // namespace

config::Result<StateLock> StateLock::take(const fs::path& state_folder) {
  std::error_code ignored;  // if this fails, opening the file fails too
  fs::create_directories(state_folder, ignored);
  config::Descriptor file = openFile(state_folder / "hapticd.lock");
  if (!file) return StateLock(config::Descriptor());
  if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
    writeHolder(file.get());
  } else if (errno == EWOULDBLOCK) {
    return std::unexpected(config::Error{
        state_folder.string(), fmt::format("another hapticd{} keeps its state there", holderOf(file.get())),
        "stop that one first, or give each its own state.folder"});
  }
  return StateLock(std::move(file));
}

}  // namespace hapticd::daemon
