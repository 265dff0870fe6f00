// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace hapticd::drivers {

/// Asks a driver's thread to end and wakes it if it sleeps in waitUntil().
/// Thread: any.  Progress: blocking.  RT: not safe.
class StopSignal {
 public:
  /// Raises the signal and wakes all waiting threads.
  void raise() {
    const std::lock_guard lock(mutex_);
    raised_ = true;
    changed_.notify_all();
  }

  /// Clears the signal for the next start; no thread may be waiting.
  void reset() {
    const std::lock_guard lock(mutex_);
    raised_ = false;
  }

  bool raised() const {
    const std::lock_guard lock(mutex_);
    return raised_;
  }

  /// Sleeps until `when` or until the signal is raised; returns true if it is raised.
  bool waitUntil(std::chrono::steady_clock::time_point when) {
    std::unique_lock lock(mutex_);
    return changed_.wait_until(lock, when, [this] { return raised_; });
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool raised_ = false;
};

}  // namespace hapticd::drivers
