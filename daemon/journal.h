// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <thread>

#include "config/base/error.h"
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

}  // namespace hapticd::daemon
