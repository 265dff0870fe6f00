#include "daemon/state/state_worker.h"

#include <signal.h>

#include "drivers/start_thread.h"

namespace hapticd::daemon {
namespace {

/// Signals are the main thread's: the thread inherits a mask that blocks them all.
config::Result<std::thread> startWithoutSignals(const std::function<void()>& body) {
  sigset_t all;
  sigset_t before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_BLOCK, &all, &before);
  auto thread = drivers::startThread("state", body);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace

StateWorker::~StateWorker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void StateWorker::add(Job job) {
  if (!thread_.joinable()) {
    auto started = startWithoutSignals([this] { work(); });
    if (!started) return job();
    thread_ = std::move(*started);
  }
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_all();
}

void StateWorker::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
}

}  // namespace hapticd::daemon
