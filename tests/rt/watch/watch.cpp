// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/watch/watch.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>

namespace hapticd::test {
namespace {

struct WatchState {
  bool watched = false;
  Misconduct misconduct;
};
constinit thread_local WatchState watch_state;

const auto kPageBytes = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));

bool kernelSeesLockedMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    if (long kilobytes = 0; key == "VmLck:") return status >> kilobytes && kilobytes > 0;
  }
  return false;
}

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

LockedMemory::LockedMemory()
    : locked_(::mlockall(MCL_CURRENT | MCL_FUTURE) == 0 && kernelSeesLockedMemory()) {}

LockedMemory::~LockedMemory() {
  ::munlockall();
}

UntouchedPage::UntouchedPage()
    : page_(::mmap(nullptr, kPageBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {
  if (page_ == MAP_FAILED) throw std::runtime_error("no page");
  // Where future memory is locked as well, the page is already present.
  ::munlock(page_, kPageBytes);
  ::madvise(page_, kPageBytes, MADV_DONTNEED);
}

UntouchedPage::~UntouchedPage() {
  ::munmap(page_, kPageBytes);
}

void UntouchedPage::touch() {
  *static_cast<volatile char*>(page_) = 1;
}

}  // namespace hapticd::test
