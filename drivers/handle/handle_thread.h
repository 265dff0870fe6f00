// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "drivers/base/stop_signal.h"
#include "drivers/base/worker_thread.h"
#include "drivers/handle/handle.h"
#include "rt/base/parameters.h"

namespace hapticd::drivers {

/// Requested scheduling of a handle's thread.
struct HandleThreadPolicy {
  int priority = 0;      ///< SCHED_FIFO priority; 0: normal scheduling
  int avoided_cpu = -1;  ///< left to the force thread; -1: none
};

/// Returns what the driver needs: a thread that carries forces runs one below loop.priority, second only to
/// the force thread; that of a device without motors runs with normal scheduling. `isolated_cpu`: the CPU
/// that the kernel keeps free for the force thread; -1: none.
HandleThreadPolicy handleThreadPolicy(const config::HandleSettings& settings, const rt::LoopParameters& loop,
                                      int isolated_cpu);

/// A started handle thread and the scheduling that it obtained.
struct HandleThread {
  std::thread thread;
  HandleScheduling scheduling;
};

/// Runs `body` in a thread that is scheduled as far as permitted.
/// Errors: the system limit on threads is reached.
base::Result<HandleThread> startHandleThread(const HandleThreadPolicy& policy,
                                             std::move_only_function<void()> body);

/// What the thread of a handle does: it looks for the device, uses it until it is lost, and starts over.
/// Owned jointly by the thread and the driver, because a thread blocked by a failing device may outlive the
/// driver.
class HandleWorker {
 public:
  virtual ~HandleWorker() = default;

  /// Runs until requestStop().  Thread: the driver's own, which ends with it.
  void run();
  /// Asks run() to leave the device without force and to end.  Thread: any except the driver's own.
  virtual void requestStop() { stop_signal_.raise(); }
  /// Returns the current state.  Thread: any.
  virtual HandleStatus status() const { return board_.snapshot(); }

 protected:
  /// `searching`: detail of the status until useDevice() has said something else.
  HandleWorker(std::string identity, const std::string& searching, std::chrono::milliseconds retry_period);

  /// Opens the device, exchanges measurements and commands until it is lost or a stop is requested, and
  /// leaves it without force.  Errors: why the device is not there, or not any longer.
  virtual base::Result<void> useDevice() = 0;
  /// Shows why the device is missing.
  void reportMissing(const base::Error& error);

  StatusBoard<HandleStatus> board_;
  StopSignal stop_signal_;
  bool seen_ = false;  // run() only: the device has been found before

 private:
  const std::chrono::milliseconds retry_period_;
};

/// A handle whose HandleWorker runs in a thread of its own.
class WorkerHandle : public Handle {
 public:
  struct Kind {
    std::string name;      ///< of the driver, for errors
    std::string identity;  ///< until the worker knows it better
    /// After which a thread that does not end is abandoned; the worker then no longer accesses the channels.
    /// Nothing: it always ends.
    std::optional<std::chrono::milliseconds> stop_limit = {};
    /// Makes a worker for one start; `channels`: null only for check(), which does not run it.
    /// Errors: permanent ones only.
    std::function<base::Result<std::shared_ptr<HandleWorker>>(HandleChannels* channels)> make;
  };

  WorkerHandle(Kind kind, const HandleThreadPolicy& policy) : kind_(std::move(kind)), policy_(policy) {}
  ~WorkerHandle() override { stop(); }

  /// Errors: those of Kind::make.
  base::Result<void> check() const final;
  /// Errors: likewise; the driver is already running, no thread can be started.
  base::Result<void> start(HandleChannels& channels) final;
  void stop() final;
  HandleStatus status() const final;

 private:
  const Kind kind_;
  const HandleThreadPolicy policy_;
  std::atomic<HandleScheduling> scheduling_{HandleScheduling{}};
  std::atomic<bool> stopped_{false};
  WorkerThread<HandleWorker> thread_;
};

}  // namespace hapticd::drivers
