// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>
#include <signal.h>

#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "config/base/error.h"

namespace hapticd::drivers {

/// While it lives, the calling thread and the threads that it creates receive no signals.
class BlockedSignals {
 public:
  BlockedSignals() {
    sigset_t all;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~BlockedSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  BlockedSignals(const BlockedSignals&) = delete;
  BlockedSignals& operator=(const BlockedSignals&) = delete;

 private:
  sigset_t before_;
};

/// Starts a thread that runs `body`, with a name of at most 15 characters that tools show. It receives no
/// signals: those are for the main thread. Errors: the system limit on threads is reached.
template <typename Body>
base::Result<std::thread> startThread(const char* name, Body body) {
  const BlockedSignals blocked;
  try {
    std::thread thread(std::move(body));
    ::pthread_setname_np(thread.native_handle(), name);
    return thread;
  } catch (const std::system_error& error) {
    return std::unexpected(base::Error{std::string("thread ") + name,
                                       std::string("cannot be started: ") + error.what(),
                                       "raise the limit of tasks (TasksMax= of the unit, ulimit -u)"});
  }
}

}  // namespace hapticd::drivers
