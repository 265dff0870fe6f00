// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"

namespace hapticd::daemon {

/// Writes to the journal with its fields where standard error goes there, else one line to standard error.
/// While a JournalThread lives, that one writes: the caller never waits for whoever reads the log, and an
/// entry for which there is no room is dropped and counted.
/// Thread: any.  Progress: blocking only without a JournalThread.
void writeToJournal(const JournalEntry& entry);

/// Waits until all entries have been written, at most for `timeout`.
/// Thread: any.
void flushJournal(std::chrono::milliseconds timeout);

struct JournalStatus {
  std::uint64_t lost = 0;  ///< entries that were dropped or could not be written, since the start
  /// How long the oldest entry has waited for the reader of the log; 0: none waits.
  std::chrono::nanoseconds waits{0};
};
/// Thread: any.
JournalStatus journalStatus();

/// While it lives, a thread of its own writes the log, which another process may leave unread: a stopped
/// terminal, a full pipe, a journal that hangs. One at a time in a process.
class JournalThread {
 public:
  /// Errors: the system provides no more threads.
  static base::Result<JournalThread> start();
  JournalThread(JournalThread&&) = default;
  JournalThread& operator=(JournalThread&&) = delete;
  /// Writes what waits, at most for kEndPatience; what nobody takes by then is lost.
  ~JournalThread();

  static constexpr std::chrono::seconds kEndPatience{1};

 private:
  explicit JournalThread(std::thread thread) : thread_(std::move(thread)) {}

  std::thread thread_;
};

/// Logs what nobody requested: changes of the mode, the camera, the handle, the warnings and the trace, and
/// breaches of forbidden regions.
/// Thread: control thread only.
class EventLog {
 public:
  using Clock = std::chrono::steady_clock;
  using Write = std::function<void(const JournalEntry&)>;

  explicit EventLog(Write write) : write_(std::move(write)) {}

  /// To be called with every tick. Where the mode changes back and forth, ten changes a second are logged and
  /// the others are counted.
  void onTick(const rt::Tick& tick, Clock::time_point now);
  /// To be called a few times a second.
  void onStatus(const BoxStatus& status);

 private:
  void logTrace(const TraceStatus& trace);
  void logMode(const rt::Tick& tick, Clock::time_point now);
  void logBreaches(const BoxStatus& status);
  void logFrames(const std::vector<FrameStatus>& frames);
  void logWarnings(const std::vector<std::string>& warnings);

  Write write_;
  rt::Mode mode_ = rt::Mode::starting;
  rt::Cause cause_ = rt::Cause::none;
  Clock::time_point second_;  // the second that logged_ and unlogged_ are counts of
  int logged_ = 0;
  int unlogged_ = 0;
  drivers::CameraState camera_ = drivers::CameraState::absent;
  drivers::HandlePresence handle_ = drivers::HandlePresence::present;
  TraceStatus trace_;
  std::uint64_t trace_news_ = 0;  // number of the newest one in the log
  /// Counters of a frame that are in the log.
  struct SeenFrame {
    std::uint64_t losses = 0;
    std::uint64_t returns = 0;
    std::uint64_t relocations = 0;
  };

  std::map<std::string, SeenFrame> frames_;
  std::map<std::string, std::int64_t> breaches_;  // by fixture: entered_ns of the newest one in the log
  std::map<std::string, std::string>
      warnings_;  // the key is the text without its numbers, which change all the time
};

}  // namespace hapticd::daemon
