// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "daemon/base/box.h"
#include "daemon/trace/reader/trace_folder.h"

namespace hapticd::daemon {

/// The bytes of a number of megabytes, as used by settings.
std::uint64_t bytesOf(double megabytes);
/// A size for people: "12.3 MB".
std::string megabytes(std::uint64_t bytes);

/// The free space on the disk of the traces. Thread: one.
class DiskSpace {
 public:
  /// `folder`: exists before the folder of the traces is created in it.
  DiskSpace(std::filesystem::path folder, double min_free_mb);

  /// Reads the free space from the system.
  void measure();
  /// Free space at the last reading; nothing: not known.
  std::optional<std::uint64_t> freeBytes() const { return free_bytes_; }

  // Unknown space is no error here: the attempt to write reports the reason.

  /// Whether a trace may go on. Errors: less than trace.min_free_mb is free.
  base::Result<void> enoughToGoOn() const { return enough(least_bytes_); }
  /// Whether a trace may start. Errors: as above, or less than its head and first chunks take, because each
  /// failed attempt would leave an incomplete file.
  base::Result<void> enoughToBegin() const;

 private:
  base::Result<void> enough(std::uint64_t least_bytes) const;

  std::filesystem::path folder_;
  std::uint64_t least_bytes_;
  std::optional<std::uint64_t> free_bytes_;
};

/// Keeps the folder of traces below trace.max_folder_mb: deletes what planRetention() allows, oldest first,
/// and refuses to record when only protected traces are left. Without a limit it deletes nothing.
///
/// A thread of its own lists and deletes, so that neither the rings nor a call waits for a large folder.
class Retention {
 public:
  /// The state of the folder, and what was done to keep its limit.
  struct Status {
    std::uint64_t folder_bytes = 0;            ///< size of all traces
    std::optional<std::uint64_t> limit_bytes;  ///< nothing: there is no limit
    std::string next;                          ///< name of the trace that is deleted next; empty: none
    std::uint64_t deleted = 0;                 ///< since the start
    std::vector<std::string> problems;         ///< each with its remedy; includes what will be deleted soon
  };
  /// Called after each deletion with name and reason.  Thread: the one that deletes.
  using OnDeleted = std::function<void(const std::string& name, const std::string& reason)>;

  Retention(std::filesystem::path folder, const config::TraceSettings& settings, OnDeleted on_deleted);
  /// Ends the thread as stop() does.
  ~Retention();
  Retention(const Retention&) = delete;
  Retention& operator=(const Retention&) = delete;

  /// Starts the thread. Errors: the system provides no more threads.
  base::Result<void> start();
  /// Finishes a deletion in progress and ends the thread; does nothing if it was not started.
  void stop();

  /// The size at which a trace continues in another file: trace.max_file_mb, but at most a quarter of the
  /// limit, so that there is always something older to delete.  Thread: any.
  std::uint64_t mostFileBytes() const noexcept { return most_file_bytes_; }

  // All functions from here on: any thread.

  /// Requests a new list because the folder has changed.
  void requestList();
  /// Requests a new list because this trace was just finished.
  void requestListAfter(const std::string& finished);
  /// Waits for the first list of the folder, but not without a limit. It is no error if the list is late.
  void awaitFirstList(std::chrono::seconds patience);
  /// Whether a trace may start. Errors: protected traces leave less than a tenth of the limit.
  base::Result<void> mayBegin() const;
  /// Whether a trace may go on. Errors: protected traces and the trace itself exceed the limit.
  base::Result<void> mayGoOn() const;
  Status status() const;

 private:
  void run();
  void lookNow();
  void deleteDown(trace::RetentionPlan& plan);
  void publish(const trace::RetentionPlan& plan, std::vector<std::string> problems);
  std::string warningOf(const trace::RetentionPlan& plan) const;
  std::optional<base::Error> refusalAbove(std::uint64_t most_bytes, const trace::RetentionPlan& plan) const;
  bool stopping() const;

  const std::filesystem::path folder_;
  const std::uint64_t limit_bytes_;  // 0: no limit
  const std::uint64_t most_file_bytes_;
  const OnDeleted on_deleted_;

  mutable std::mutex mutex_;  // protects the next eight members
  std::condition_variable wake_;
  bool stop_ = false;
  bool due_ = true;
  bool looked_ = false;
  std::string just_finished_;
  Status status_;
  std::optional<base::Error> begin_refusal_;
  std::optional<base::Error> go_on_refusal_;

  std::thread thread_;
};

/// Finishes the traces that a crash has left open, once, in a thread of its own.
class CrashRecovery {
 public:
  /// What has been done so far.
  struct Status {
    std::uint64_t recovered = 0;
    std::vector<std::string> problems;  ///< each with its remedy
  };

  /// `news` and `changed` (a trace of the folder has changed) are called in the thread.
  CrashRecovery(std::filesystem::path folder, std::function<void(TraceNews)> news,
                std::function<void()> changed)
      : folder_(std::move(folder)), news_(std::move(news)), changed_(std::move(changed)) {}
  ~CrashRecovery() { stop(); }
  CrashRecovery(const CrashRecovery&) = delete;
  CrashRecovery& operator=(const CrashRecovery&) = delete;

  /// To be called before there is a trace of this process.  Errors: no thread can be started.
  base::Result<void> begin();
  /// Ends within a chunk; the next start of the daemon goes on.
  void stop();

  /// Thread: any.
  Status status() const;

 private:
  void finish(const std::vector<std::string>& names);

  const std::filesystem::path folder_;
  const std::function<void(TraceNews)> news_;
  const std::function<void()> changed_;
  mutable std::mutex mutex_;  // protects the next member
  Status status_;
  std::atomic<bool> stops_ = false;
  std::thread thread_;
};

}  // namespace hapticd::daemon
