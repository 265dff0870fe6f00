// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/handle_thread.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <utility>

#include "config/settings/driver_rows.h"
#include "drivers/base/start_thread.h"

namespace hapticd::drivers {
namespace {

/// Excludes a CPU; a thread that may run nowhere else stays there.
void keepOff(int cpu, pthread_t thread) {
  cpu_set_t set;
  if (cpu < 0 || cpu >= CPU_SETSIZE || ::pthread_getaffinity_np(thread, sizeof set, &set) != 0) return;
  CPU_CLR(static_cast<std::size_t>(cpu), &set);
  if (CPU_COUNT(&set) > 0) ::pthread_setaffinity_np(thread, sizeof set, &set);
}

}  // namespace

HandleThreadPolicy handleThreadPolicy(const config::HandleSettings& settings, const rt::LoopParameters& loop,
                                      int isolated_cpu) {
  const bool exerts_force = config::driverOf(settings).exerts_force(settings);
  return {exerts_force ? std::max(0, loop.priority - 1) : 0, isolated_cpu};
}

base::Result<HandleThread> startHandleThread(const HandleThreadPolicy& policy,
                                             std::move_only_function<void()> body) {
  auto thread = startThread("handle", std::move(body));
  if (!thread) return std::unexpected(thread.error());
  const pthread_t handle = thread->native_handle();
  keepOff(policy.avoided_cpu, handle);
  HandleScheduling scheduling{policy.priority, 0};
  sched_param parameters{};
  parameters.sched_priority = policy.priority;
  if (policy.priority > 0 && ::pthread_setschedparam(handle, SCHED_FIFO, &parameters) == 0) {
    scheduling.priority = policy.priority;
  }
  return HandleThread{std::move(*thread), scheduling};
}

HandleWorker::HandleWorker(std::string identity, const std::string& searching,
                           std::chrono::milliseconds retry_period)
    : retry_period_(retry_period) {
  board_.reset(std::move(identity));
  board_.set(HandlePresence::absent, searching);
}

void HandleWorker::run() {
  using Clock = std::chrono::steady_clock;
  for (auto next_try = Clock::now(); !stop_signal_.waitUntil(next_try);
       next_try = Clock::now() + retry_period_) {
    if (const auto used = useDevice(); !used) reportMissing(used.error());
  }
}

void HandleWorker::reportMissing(const base::Error& error) {
  board_.set(seen_ ? HandlePresence::lost : HandlePresence::absent, error.text());
}

base::Result<void> WorkerHandle::check() const {
  const auto worker = kind_.make(nullptr);
  return worker ? base::Result<void>() : std::unexpected(worker.error());
}

base::Result<void> WorkerHandle::start(HandleChannels& channels) {
  auto worker = kind_.make(&channels);
  if (!worker) return std::unexpected(worker.error());
  stopped_ = false;
  const auto startThread = [this](auto body) -> base::Result<std::thread> {
    auto started = startHandleThread(policy_, std::move(body));
    if (!started) return std::unexpected(started.error());
    scheduling_ = started->scheduling;
    return std::move(started->thread);
  };
  return thread_.start(std::move(*worker), kind_.name, startThread);
}

void WorkerHandle::stop() {
  thread_.stop(kind_.stop_limit);
  stopped_ = true;
}

HandleStatus WorkerHandle::status() const {
  HandleStatus status = thread_.status(kind_.identity);
  status.scheduling = scheduling_;
  if (stopped_) {
    status.state = HandlePresence::absent;
    status.detail = "stopped";
  }
  return status;
}

}  // namespace hapticd::drivers
