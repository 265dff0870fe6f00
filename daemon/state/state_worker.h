// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

#include "config/base/error.h"

namespace hapticd::daemon {

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
