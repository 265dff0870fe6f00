// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/watch/watch.h"

#include <sys/resource.h>

namespace hapticd::test {
namespace {

struct WatchState {
  bool watched = false;
  Misconduct misconduct;
};
constinit thread_local WatchState watch_state;

}  // namespace

void noteAllocation() noexcept {
  if (watch_state.watched) ++watch_state.misconduct.allocations;
}
void noteLock() noexcept {
  if (watch_state.watched) ++watch_state.misconduct.locks;
}
void noteException() noexcept {
  if (watch_state.watched) ++watch_state.misconduct.exceptions;
}

PageFaults pageFaults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

WatchedSection::WatchedSection() : before_(pageFaults()) {
  watch_state.misconduct = {};
  watch_state.watched = true;
}

WatchedSection::~WatchedSection() {
  watch_state.watched = false;
}

WatchedSection::Seen WatchedSection::end() {
  watch_state.watched = false;
  const PageFaults now = pageFaults();
  return {watch_state.misconduct, {now.minor - before_.minor, now.major - before_.major}};
}

}  // namespace hapticd::test
