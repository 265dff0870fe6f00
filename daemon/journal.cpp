// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/counted.h"
#include "config/base/value_text.h"
#include "daemon/base/journal_entry.h"
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

namespace {

using Priority = JournalEntry::Priority;
using config::EventKind;

constexpr int kModesPerSecond = 10;

Priority priorityOf(rt::Mode mode) {
  if (mode == rt::Mode::faulted) return Priority::error;
  return mode == rt::Mode::holding ? Priority::warning : Priority::notice;
}

std::string withoutNumbers(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::isdigit(c) != 0; });
  return text;
}

std::string withDetail(std::string text, const std::string& detail) {
  return detail.empty() ? text : text + ": " + detail;
}

}  // namespace

void EventLog::onTick(const rt::Tick& tick, Clock::time_point now) {
  if (tick.mode == mode_ && tick.cause == cause_) return;
  mode_ = tick.mode;
  cause_ = tick.cause;
  logMode(tick, now);
}

void EventLog::logMode(const rt::Tick& tick, Clock::time_point now) {
  if (now - second_ >= std::chrono::seconds(1)) {
    second_ = now;
    logged_ = 0;
    if (unlogged_ > 0) {
      write_({Priority::warning,
              fmt::format("{} changes of mode were not logged", std::exchange(unlogged_, 0))});
    }
  }
  if (++logged_ > kModesPerSecond) {
    ++unlogged_;
    return;
  }
  write_({priorityOf(tick.mode),
          fmt::format("{} ({})", nameOf(tick.mode), nameOf(tick.cause)),
          EventKind::mode,
          {{"MODE", nameOf(tick.mode)}, {"CAUSE", nameOf(tick.cause)}}});
}

void EventLog::onStatus(const BoxStatus& status) {
  if (const auto state = status.camera.state; state != camera_) {
    camera_ = state;
    write_({state == drivers::CameraState::streaming ? Priority::notice : Priority::warning,
            withDetail(fmt::format("camera {} ({})", nameOf(state), status.camera.identity),
                       status.camera.detail),
            EventKind::camera,
            {{"CAMERA", nameOf(state)}, {"DEVICE", status.camera.identity}}});
  }
  if (const auto state = status.handle.state; state != handle_) {
    handle_ = state;
    write_({state == drivers::HandlePresence::present ? Priority::notice : Priority::warning,
            withDetail(fmt::format("handle {} ({})", nameOf(state), status.handle.identity),
                       status.handle.detail),
            EventKind::handle,
            {{"HANDLE", nameOf(state)}, {"DEVICE", status.handle.identity}}});
  }
  logBreaches(status);
  logFrames(status.frames);
  logTrace(status.trace);
  logWarnings(status.warnings);
}

/// A breach is known by when it began, because a fixture that is removed and added again counts anew.
void EventLog::logBreaches(const BoxStatus& status) {
  for (const FixtureConduct& fixture : status.fixtures.each) {
    const rt::Breach& breach = fixture.breach;
    std::int64_t& logged_ns = breaches_[fixture.name];
    if (breach.number == 0 || breach.entered_ns <= logged_ns) continue;
    logged_ns = breach.entered_ns;
    const rt::Vec3& place = breach.entered_m_in_world;
    const double age_s = static_cast<double>(status.loop.state.tick.planned_ns - breach.entered_ns) * 1e-9;
    write_(
        {Priority::info,
         fmt::format(
             "the HIP was in the forbidden region of fixture {} for {:.2f} s, at most {:.1f} mm deep, with "
             "at most {:.3f} m/s and {:.2f} N; it entered {:.1f} s ago with {:.3f} m/s at ({:.4f}, {:.4f}, "
             "{:.4f}) m in the world",
             fixture.name, breach.duration_s, breach.depth_m * 1e3, breach.speed_m_per_s, breach.force_n,
             age_s, breach.entry_m_per_s, place.x, place.y, place.z),
         EventKind::breach,
         {{"FIXTURE", fixture.name},
          {"ENTERED_AGE_S", fmt::format("{:.3f}", age_s)},
          {"ENTERED_M", fmt::format("{:.5f} {:.5f} {:.5f}", place.x, place.y, place.z)},
          {"DURATION_S", fmt::format("{:.3f}", breach.duration_s)},
          {"DEPTH_M", fmt::format("{:.5f}", breach.depth_m)},
          {"ENTRY_SPEED_M_PER_S", fmt::format("{:.4f}", breach.entry_m_per_s)},
          {"SPEED_M_PER_S", fmt::format("{:.4f}", breach.speed_m_per_s)},
          {"FORCE_N", fmt::format("{:.3f}", breach.force_n)}}});
  }
}

/// A frame that was removed and added again counts anew.
void EventLog::logFrames(const std::vector<FrameStatus>& frames) {
  for (const FrameStatus& frame : frames) {
    SeenFrame& seen = frames_[frame.name];
    const auto log = [&](Priority priority, std::string text, const char* action) {
      write_({priority,
              std::move(text),
              EventKind::frame,
              {{"FRAME", frame.name}, {"ACTION", action}, {"STATE", nameOf(frame.state)}}});
    };
    if (frame.losses > seen.losses) {
      log(Priority::warning,
          fmt::format("frame {} is lost: its poses are {}", frame.name,
                      frame.refusal ? fmt::format("refused: {}", reasonOf(*frame.refusal)) : "missing"),
          "lost");
    }
    if (frame.relocations > seen.relocations) {
      log(Priority::notice,
          fmt::format("frame {} has jumped: three poses agree on its new place, and it goes there slowly",
                      frame.name),
          "relocated");
    }
    if (frame.returns > seen.returns) {
      log(Priority::notice,
          fmt::format("frame {} {}", frame.name, frame.returns == 1 ? "has its first place" : "is back"),
          "found");
    }
    seen = {frame.losses, frame.returns, frame.relocations};
  }
}

void EventLog::logWarnings(const std::vector<std::string>& warnings) {
  std::map<std::string, std::string> now;
  for (const std::string& warning : warnings) now.emplace(withoutNumbers(warning), warning);
  for (const auto& [key, text] : warnings_) {
    if (now.contains(key)) continue;
    write_({Priority::notice, "resolved: " + text, EventKind::warning, {{"STATE", "end"}}});
  }
  for (const auto& [key, text] : now) {
    if (warnings_.contains(key)) continue;
    write_({Priority::warning, text, EventKind::warning, {{"STATE", "begin"}}});
  }
  warnings_ = std::move(now);
}

void EventLog::logTrace(const TraceStatus& trace) {
  const auto log = [&](Priority priority, std::string text, const std::string& name) {
    write_({priority, std::move(text), EventKind::trace, {{"TRACE", name}}});
  };
  if (trace.state == TraceState::writing && trace.name != trace_.name) {
    log(Priority::notice, fmt::format("trace {} is written", trace.name), trace.name);
  } else if (trace.state == TraceState::waiting && trace_.state != TraceState::waiting) {
    log(Priority::error, "the trace waits: " + trace.detail, trace_.name);
  } else if (trace.state == TraceState::off && trace_.state != TraceState::off) {
    log(Priority::notice, fmt::format("trace {} has ended", trace_.name), trace_.name);
  }
  if (trace.last_dump != trace_.last_dump) {
    log(Priority::notice, fmt::format("flight recorder written to {}", trace.last_dump), trace.last_dump);
  }
  if (trace.recovered != trace_.recovered) {
    log(Priority::warning,
        fmt::format("finished after a crash: {}", base::counted(trace.recovered, "trace(s)")), "");
  }
  for (const TraceNews& news : trace.news) {
    if (news.number <= trace_news_) continue;
    trace_news_ = news.number;
    write_({news.warning ? Priority::warning : Priority::notice,
            news.text,
            EventKind::trace,
            {{"ACTION", news.action}, {"TRACE", news.trace}}});
  }
  trace_ = trace;
}

}  // namespace hapticd::daemon
