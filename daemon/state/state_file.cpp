// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/state_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "config/base/descriptor.h"
#include "config/base/file_content.h"
#include "config/base/held_bytes.h"
#include "drivers/base/start_thread.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFileBytes = 1024 * 1024;
constexpr const char* kTemporaryEnding = ".new";

std::string remedyFor(int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return "create the folder, or name another one in state.folder";
    case EACCES:
    case EPERM:
    case EROFS:
      return "give the user of hapticd the right to write there, or name another folder in state.folder";
    case ENOSPC:
    case EDQUOT:
      return "make space on the disk";
    default:
      return "check the disk of state.folder";
  }
}

std::unexpected<base::Error> failure(const fs::path& file, const char* what, int error) {
  return base::failure(file.string(), fmt::format("{}: {}", what, std::generic_category().message(error)),
                       remedyFor(error));
}

bool writeAll(int descriptor, std::string_view content) {
  while (!content.empty()) {
    const ssize_t count = ::write(descriptor, content.data(), std::min(content.size(), base::kBytesAtOnce));
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) content.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool synchronise(const fs::path& folder) {
  const base::Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return descriptor && ::fsync(descriptor.get()) == 0;
}

}  // namespace

base::Result<void> replaceFile(const fs::path& file, std::string_view content) {
  std::error_code ignored;  // writing fails then too, and reports the reason
  fs::create_directories(file.parent_path(), ignored);
  const fs::path temporary = file.string() + kTemporaryEnding;
  ::unlink(temporary.c_str());  // left behind by a process that crashed
  base::Descriptor descriptor(
      ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!descriptor) return failure(file, "cannot be written", errno);
  if (!writeAll(descriptor.get(), content) || ::fsync(descriptor.get()) != 0 ||
      std::rename(temporary.c_str(), file.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary.c_str());
    return failure(file, "cannot be written", error);
  }
  if (!synchronise(file.parent_path())) return failure(file, "may not survive a loss of power", errno);
  return {};
}

base::Result<void> removeFile(const fs::path& file) {
  if (::unlink(file.c_str()) != 0) {
    if (errno == ENOENT) return {};
    return failure(file, "cannot be removed", errno);
  }
  if (!synchronise(file.parent_path())) return failure(file, "may come back after a loss of power", errno);
  return {};
}

base::Result<std::optional<std::string>> readStateFile(const fs::path& file) {
  auto content = base::fileContent(file, {.longest = kMaxFileBytes, .follow_link = false});
  if (content) return std::move(*content);
  using Reason = base::FileFault::Reason;
  const base::FileFault& fault = content.error();
  if (fault.reason == Reason::unreadable && (fault.error_number == ENOENT || fault.error_number == ENOTDIR)) {
    return std::nullopt;
  }
  if (fault.reason == Reason::unreadable) return failure(file, "cannot be read", fault.error_number);
  return base::failure(file.string(), fault.text(), "remove it, and save it again");
}

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

/// Of processes that were killed while they replaced a file; in the folders that nobody else writes to.
void removeTemporaries(const fs::path& state_folder) {
  for (const auto& [folder, ending] : {std::pair{"profiles", ".yaml"}, {"solids", ".solid"}}) {
    std::error_code error;
    for (fs::directory_iterator file(state_folder / folder, error);
         !error && file != fs::directory_iterator(); file.increment(error)) {
      if (file->path().extension() == kTemporaryEnding && file->path().stem().extension() == ending)
        ::unlink(file->path().c_str());
    }
  }
}

/// Only the daemon's user may open the file: anyone who may read it could lock it and prevent hapticd from
/// starting.
base::Descriptor openFile(const fs::path& file) {
  constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  base::Descriptor writable(::open(file.c_str(), O_RDWR | O_CREAT | kFlags, 0600));
  return writable ? std::move(writable) : base::Descriptor(::open(file.c_str(), O_RDONLY | kFlags));
}

}  // namespace

base::Result<StateLock> StateLock::take(const fs::path& state_folder) {
  std::error_code ignored;  // if this fails, opening the file fails too
  fs::create_directories(state_folder, ignored);
  base::Descriptor file = openFile(state_folder / "hapticd.lock");
  if (!file) return StateLock(base::Descriptor());
  if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
    writeHolder(file.get());
    removeTemporaries(state_folder);
  } else if (errno == EWOULDBLOCK) {
    return base::failure(state_folder.string(),
                         fmt::format("another hapticd{} keeps its state there", holderOf(file.get())),
                         "stop that one first, or give each its own state.folder");
  }
  return StateLock(std::move(file));
}

StateWorker::~StateWorker() {
  if (!thread_.joinable()) return;
  if (endsInTime()) {
    thread_.join();
  } else {
    thread_.detach();  // it waits for a disk that does not answer, and uses only the Queue, which it shares
  }
}

bool StateWorker::endsInTime() {
  std::unique_lock lock(queue_->mutex);
  queue_->ending = true;
  queue_->changed.notify_all();
  const bool ended = queue_->changed.wait_for(lock, end_timeout_, [this] { return queue_->ended; });
  if (!ended) queue_->jobs.clear();
  return ended;
}

base::Result<void> StateWorker::add(Job job) {
  if (!thread_.joinable()) {
    auto started = drivers::startThread("state", [queue = queue_] { work(*queue); });
    if (!started) return std::unexpected(started.error());
    thread_ = std::move(*started);
  }
  {
    const std::lock_guard lock(queue_->mutex);
    queue_->jobs.push_back(std::move(job));
  }
  queue_->changed.notify_all();
  return {};
}

void StateWorker::work(Queue& queue) {
  std::unique_lock lock(queue.mutex);
  for (;;) {
    queue.changed.wait(lock, [&queue] { return queue.ending || !queue.jobs.empty(); });
    if (queue.jobs.empty()) break;
    Job job = std::move(queue.jobs.front());
    queue.jobs.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
  queue.ended = true;
  queue.changed.notify_all();
}

}  // namespace hapticd::daemon
