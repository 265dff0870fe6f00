// SPDX-License-Identifier: Apache-2.0
#pragma once

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

#include "config/error.h"
#include "config/settings.h"
#include "drivers/trace/trace_retention.h"

namespace hapticd::daemon {

/// Keeps the folder of traces below trace.max_folder_mb: deletes what planRetention() allows, the oldest
/// first, and refuses recording where only protected traces are left. Without a limit it deletes nothing.
///
/// A thread of its own lists and deletes, so that neither the rings nor a call ever waits for a large folder.
class Retention {
 public:
  /// What it has found and done.
  struct Status {
    std::uint64_t folder_bytes = 0;            ///< of all traces
    std::optional<std::uint64_t> limit_bytes;  ///< nothing: there is no limit
    std::string next;                          ///< name of the trace that is deleted next; empty: none
    std::uint64_t deleted = 0;                 ///< since the start
    std::vector<std::string> problems;         ///< with what to do; also what is about to be deleted
  };
  /// Told of each deletion: name and reason.  Thread: the one that deletes.
  using Tell = std::function<void(const std::string& name, const std::string& reason)>;

  Retention(std::filesystem::path folder, const config::TraceSettings& settings, Tell tell);
  /// Like stop().
  ~Retention();
  Retention(const Retention&) = delete;
  Retention& operator=(const Retention&) = delete;

  /// Errors: the system gives no more threads.
  config::Result<void> start();
  /// Ends the thread; a deletion that goes on is brought to its end. Harmless when not started.
  void stop();

  /// At what size a trace goes on in another file: trace.max_file_mb, but no more than a quarter of the
  /// limit, so that there is always something older that may be deleted.  Thread: any.
  std::uint64_t mostFileBytes() const noexcept { return most_file_bytes_; }

  // Thread: any.

  /// The folder has changed: it is listed again.
  void look();
  /// The same; this trace has just been finished.
  void lookAfter(const std::string& finished);
  /// Waits for the first list of the folder; without a limit it does not wait. Nothing depends on whether it
  /// came in time.
  void awaitFirstLook(std::chrono::seconds patience);
  /// Whether a trace may begin. Errors: what is protected fills the folder but for a tenth of the limit.
  config::Result<void> mayBegin() const;
  /// Whether it may go on. Errors: what is protected, with the trace itself, is more than the limit.
  config::Result<void> mayGoOn() const;
  Status status() const;

 private:
  void run();
  void lookNow();
  void deleteDown(drivers::RetentionPlan& plan);
  void publish(const drivers::RetentionPlan& plan, std::vector<std::string> problems);
  std::string warningOf(const drivers::RetentionPlan& plan) const;
  std::optional<config::Error> refusalAbove(std::uint64_t most_bytes,
                                            const drivers::RetentionPlan& plan) const;
  bool stopping() const;

  const std::filesystem::path folder_;
  const std::uint64_t limit_bytes_;  // 0: none
  const std::uint64_t most_file_bytes_;
  const Tell tell_;

  mutable std::mutex mutex_;  // of the next eight
  std::condition_variable wake_;
  bool stop_ = false;
  bool due_ = true;
  bool looked_ = false;
  std::string just_finished_;
  Status status_;
  std::optional<config::Error> begin_refusal_;
  std::optional<config::Error> go_on_refusal_;

  std::thread thread_;
};

}  // namespace hapticd::daemon
