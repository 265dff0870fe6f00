#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

namespace hapticd::daemon {

/// A thread that does what may wait for the disk, one job after the other in the order of the calls. It
/// starts with the first job; where the system gives no thread, jobs are done in the caller's.
/// Thread: one caller.
class StateWorker {
 public:
  StateWorker() = default;
  StateWorker(const StateWorker&) = delete;
  StateWorker& operator=(const StateWorker&) = delete;
  /// Does all jobs first.
  ~StateWorker();

  /// `job` throws nothing and refers to nothing that the caller changes.
  template <typename Job>
  std::future<std::invoke_result_t<Job>> run(Job job) {
    std::packaged_task<std::invoke_result_t<Job>()> task(std::move(job));
    auto outcome = task.get_future();
    add([task = std::move(task)]() mutable { task(); });
    return outcome;
  }

 private:
  using Job = std::move_only_function<void()>;

  void add(Job job);
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace hapticd::daemon
