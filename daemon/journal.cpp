// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/value_text.h"
#include "drivers/base/start_thread.h"

namespace hapticd::daemon {
namespace {

using Clock = std::chrono::steady_clock;

/// How much may wait for the reader of the log: a few hundred entries.
constexpr std::size_t kMaxWaitingBytes = 64 * 1024;

/// systemd.exec(5): JOURNAL_STREAM names device and inode of the stream that goes to the journal; a child
/// whose standard error was redirected inherits the variable all the same.
bool standardErrorIsJournal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  return stream != nullptr && ::fstat(STDERR_FILENO, &file) == 0 &&
         fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

iovec vectorOf(std::string& field) {
  return {field.data(), field.size()};
}

bool sendToJournal(const JournalEntry& entry) {
  std::vector<std::string> fields{"MESSAGE=" + base::printable(entry.text),
                                  fmt::format("PRIORITY={}", static_cast<int>(entry.priority))};
  if (entry.event) fields.push_back(fmt::format("HAPTICD_EVENT={}", rt::wordOf(*entry.event)));
  for (const auto& [name, value] : entry.fields)
    fields.push_back(fmt::format("HAPTICD_{}={}", name, base::printable(value)));
  std::vector<iovec> vectors;
  for (std::string& field : fields) vectors.push_back(vectorOf(field));
  return ::sd_journal_sendv(vectors.data(), static_cast<int>(vectors.size())) >= 0;
}

/// Not through stdio, whose lock a blocked thread would hold when the process ends.
bool printLine(const JournalEntry& entry) {
  const std::string line = fmt::format("hapticd: {}\n", base::printable(entry.text));
  for (std::string_view rest = line; !rest.empty();) {
    const ssize_t count = ::write(STDERR_FILENO, rest.data(), rest.size());
    if (count >= 0) {
      rest.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno == EAGAIN) {  // whoever shares the descriptor may have set O_NONBLOCK
      pollfd writable{STDERR_FILENO, POLLOUT, 0};
      ::poll(&writable, 1, -1);
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

/// True if it was written.
bool deliver(const JournalEntry& entry) {
  static const bool journal = standardErrorIsJournal();
  return journal ? sendToJournal(entry) : printLine(entry);
}

std::size_t bytesOf(const JournalEntry& entry) {
  std::size_t bytes = sizeof entry + entry.text.size();
  for (const auto& [name, value] : entry.fields) bytes += sizeof entry.fields[0] + value.size();
  return bytes;
}

/// The entries on their way from all threads to the one that writes them.
class Queue {
 public:
  void open(bool open) {
    const std::lock_guard lock(mutex_);
    ending_ = false;
    open_ = open;
  }

  /// False while nobody writes what is added.
  bool add(const JournalEntry& entry) {
    const std::lock_guard lock(mutex_);
    if (!open_) return false;
    noteGap();
    if (!waiting_.empty() && waiting_bytes_ + bytesOf(entry) > kMaxWaitingBytes) {
      ++lost_;
      ++gap_;
    } else {
      push(entry);
    }
    return true;
  }

  /// Waits for the next entry; nothing when it has to end and all have been taken.
  std::optional<JournalEntry> take() {
    std::unique_lock lock(mutex_);
    written_ = true;
    if (waiting_.empty()) noteGap();
    changed_.notify_all();
    changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (waiting_.empty()) {
      open_ = false;
      return std::nullopt;
    }
    JournalEntry entry = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= bytesOf(entry);
    written_ = false;
    since_ = Clock::now();
    return entry;
  }

  void countFailure() {
    const std::lock_guard lock(mutex_);
    ++lost_;
  }

  /// True when all has been written before `timeout` is over.
  bool flush(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, timeout, [this] { return !open_ || (waiting_.empty() && written_); });
  }

  void end() {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    changed_.notify_all();
  }

  JournalStatus status() const {
    const std::lock_guard lock(mutex_);
    return {lost_, written_ ? std::chrono::nanoseconds(0) : Clock::now() - since_};
  }

 private:
  /// Says where entries are missing, as soon as there is room for that.
  void noteGap() {
    if (gap_ == 0 || waiting_bytes_ > kMaxWaitingBytes / 2) return;
    push({JournalEntry::Priority::warning,
          fmt::format("{} log entries are missing here, because nothing took them", std::exchange(gap_, 0))});
  }

  void push(JournalEntry entry) {
    waiting_bytes_ += bytesOf(entry);
    waiting_.push_back(std::move(entry));
    changed_.notify_all();
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<JournalEntry> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t gap_ = 0;  // those of lost_ that the log does not say yet
  bool open_ = false;      // a thread takes the entries
  bool ending_ = false;
  bool written_ = true;      // the entry that was taken last
  Clock::time_point since_;  // when it was taken
};

/// Never destroyed, because a thread that nobody can end may still use it when main() is over.
Queue& queue() {
  static Queue& queue = *new Queue;
  return queue;
}

void writeAll() {
  while (const auto entry = queue().take()) {
    if (!deliver(*entry)) queue().countFailure();
  }
}

}  // namespace

void writeToJournal(const JournalEntry& entry) {
  if (!queue().add(entry)) deliver(entry);
}

void flushJournal(std::chrono::milliseconds timeout) {
  queue().flush(timeout);
}

JournalStatus journalStatus() {
  return queue().status();
}

base::Result<JournalThread> JournalThread::start() {
  queue().open(true);
  auto thread = drivers::startThread("journal", writeAll);
  if (thread) return JournalThread(std::move(*thread));
  queue().open(false);
  return std::unexpected(thread.error());
}

JournalThread::~JournalThread() {
  if (!thread_.joinable()) return;
  queue().end();
  queue().flush(kEndPatience) ? thread_.join() : thread_.detach();
}

}  // namespace hapticd::daemon
