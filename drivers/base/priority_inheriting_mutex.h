// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

namespace hapticd::drivers {

/// A mutex whose holder inherits the priority of the most urgent waiting thread, so that a real-time thread
/// does not wait for whatever preempts a holder of normal priority.
/// Thread: any.  Progress: blocking.  RT: not safe.
class PriorityInheritingMutex {
 public:
  PriorityInheritingMutex() {
    pthread_mutexattr_t attributes;
    ::pthread_mutexattr_init(&attributes);
    ::pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    ::pthread_mutex_init(&mutex_, &attributes);
    ::pthread_mutexattr_destroy(&attributes);
  }
  ~PriorityInheritingMutex() { ::pthread_mutex_destroy(&mutex_); }
  PriorityInheritingMutex(const PriorityInheritingMutex&) = delete;
  PriorityInheritingMutex& operator=(const PriorityInheritingMutex&) = delete;

  // Interface required by std::lock_guard.
  void lock() { ::pthread_mutex_lock(&mutex_); }
  void unlock() { ::pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

}  // namespace hapticd::drivers
