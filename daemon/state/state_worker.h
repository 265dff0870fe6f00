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

namespace hapticd::daemon {

/// A thread for jobs that may wait for the disk; it does them one at a time, in the order of the calls. It
/// starts with the first job. If the system provides no thread, the caller's thread does the jobs.
/// Thread: one caller.
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

  /// Adds a job. It must not throw, and must not refer to data that the caller changes or that ends with the
  /// worker.
  template <typename Job>
  std::future<std::invoke_result_t<Job>> run(Job job) {
    std::packaged_task<std::invoke_result_t<Job>()> task(std::move(job));
    auto outcome = task.get_future();
    add([task = std::move(task)]() mutable { task(); });
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

  void add(Job job);
  bool endsInTime();
  static void work(Queue& queue);

  std::chrono::milliseconds end_timeout_;
  std::shared_ptr<Queue> queue_;
  std::thread thread_;
};

}  // namespace hapticd::daemon
