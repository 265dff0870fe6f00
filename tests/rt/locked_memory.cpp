// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/locked_memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>

namespace hapticd::test {
namespace {

const auto kPageBytes = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));

bool kernelSeesLockedMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    if (long kilobytes = 0; key == "VmLck:") return status >> kilobytes && kilobytes > 0;
  }
  return false;
}

}  // namespace

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
