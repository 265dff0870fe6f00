// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>

#include "config/base/descriptor.h"
#include "config/base/error.h"

namespace hapticd::daemon {

/// Replaces the content of a file. After a crash or a power failure the file has either its new content or
/// its old one: a temporary file beside it is written, synchronised and renamed. Creates a missing folder.
/// Errors: no permission, no space; the file is unchanged then.
/// Thread: any.  Progress: blocking (the disk).
base::Result<void> replaceFile(const std::filesystem::path& file, std::string_view content);

/// Removes a file. Errors: no permission; a missing file is no error.
/// Thread: any.  Progress: blocking.
base::Result<void> removeFile(const std::filesystem::path& file);

/// The content of a file of at most 1 MiB, or nothing where there is no file.
/// Errors: it is longer, a link or no regular file, no permission.
/// Thread: any.  Progress: blocking.
base::Result<std::optional<std::string>> readStateFile(const std::filesystem::path& file);

/// Ensures that only this process writes to a state folder, by a lock on the file `hapticd.lock` in it, which
/// contains the process ID. The lock ends with the object, or with the process however that ends.
/// Thread: any.  Progress: blocking (the disk).
class StateLock {
 public:
  /// Creates a missing folder, and removes what replaceFile() of a killed process has left in one. Holds no
  /// lock if the folder and the file can neither be created nor opened, because nothing can be written there
  /// then. Errors: another process holds the lock.
  static base::Result<StateLock> take(const std::filesystem::path& state_folder);

  bool held() const { return static_cast<bool>(file_); }

 private:
  explicit StateLock(base::Descriptor file) : file_(std::move(file)) {}

  base::Descriptor file_;
};

/// A thread for jobs that may wait for the disk; it does them one at a time, in the order of the calls. It
/// starts with the first job. Thread: one caller.
class StateWorker {
 public:
  /// `end_timeout`: how long the destructor waits for jobs.
  explicit StateWorker(std::chrono::milliseconds end_timeout = std::chrono::seconds(5))
      : end_timeout_(end_timeout), queue_(std::make_shared<Queue>()) {}
  StateWorker(const StateWorker&) = delete;
  StateWorker& operator=(const StateWorker&) = delete;
  /// Finishes all jobs, but waits no longer than the time-out, so that a disk that does not respond
  /// cannot keep the daemon from stopping. Jobs that have not started by then are dropped.
  ~StateWorker();

  /// Adds a job, which returns a base::Result or an expected with a list of errors. It must not throw, and
  /// must not refer to data that the caller changes or that ends with the worker. Errors: if the system
  /// provides no thread, the result of the job is that error; the caller never does the job itself.
  template <typename Job>
  std::future<std::invoke_result_t<Job>> run(Job job) {
    using Outcome = std::invoke_result_t<Job>;
    std::packaged_task<Outcome()> task(std::move(job));
    auto outcome = task.get_future();
    if (auto added = add([task = std::move(task)]() mutable { task(); }); !added) {
      std::promise<Outcome> failed;
      failed.set_value(std::unexpected(typename Outcome::error_type{added.error()}));
      return failed.get_future();
    }
    return outcome;
  }

 private:
  using Job = std::move_only_function<void()>;

  /// Shared with the thread, which may outlive the worker.
  struct Queue {
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<Job> jobs;
    bool ending = false;
    bool ended = false;
  };

  base::Result<void> add(Job job);
  bool endsInTime();
  static void work(Queue& queue);

  std::chrono::milliseconds end_timeout_;
  std::shared_ptr<Queue> queue_;
  std::thread thread_;
};

}  // namespace hapticd::daemon
