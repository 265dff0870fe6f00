// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/state_worker.h"

#include "drivers/base/start_thread.h"

namespace hapticd::daemon {

StateWorker::~StateWorker() {
  if (!thread_.joinable()) return;
  if (endsInTime()) {
    thread_.join();
  } else {
    thread_.detach();  // it waits for a disk that does not answer, and uses only the Queue, which it shares
  }
}

bool StateWorker::endsInTime() {
  std::unique_lock lock(queue_->mutex);
  queue_->ending = true;
  queue_->changed.notify_all();
  const bool ended = queue_->changed.wait_for(lock, end_timeout_, [this] { return queue_->ended; });
  if (!ended) queue_->jobs.clear();
  return ended;
}

base::Result<void> StateWorker::add(Job job) {
  if (!thread_.joinable()) {
    auto started = drivers::startThread("state", [queue = queue_] { work(*queue); });
    if (!started) return std::unexpected(started.error());
    thread_ = std::move(*started);
  }
  {
    const std::lock_guard lock(queue_->mutex);
    queue_->jobs.push_back(std::move(job));
  }
  queue_->changed.notify_all();
  return {};
}

void StateWorker::work(Queue& queue) {
  std::unique_lock lock(queue.mutex);
  for (;;) {
    queue.changed.wait(lock, [&queue] { return queue.ending || !queue.jobs.empty(); });
    if (queue.jobs.empty()) break;
    Job job = std::move(queue.jobs.front());
    queue.jobs.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
  queue.ended = true;
  queue.changed.notify_all();
}

}  // namespace hapticd::daemon
