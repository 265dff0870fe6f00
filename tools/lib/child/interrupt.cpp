// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/child/interrupt.h"

#include <signal.h>

#include <atomic>
#include <initializer_list>

namespace hapticd::tools {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  ::sigaction(signal, &action, nullptr);
}

}  // namespace

Interrupt::Interrupt() {
  interrupted = false;
  for (const int signal : {SIGINT, SIGTERM}) handle(signal, [](int) { interrupted = true; });
}

Interrupt::~Interrupt() {
  for (const int signal : {SIGINT, SIGTERM}) handle(signal, SIG_DFL);
}

bool Interrupt::requested() const noexcept {
  return interrupted;
}

}  // namespace hapticd::tools
