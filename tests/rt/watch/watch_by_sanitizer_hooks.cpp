// SPDX-License-Identifier: Apache-2.0
#include <cstddef>

#include "tests/rt/watch/watch.h"

// The sanitizers replace malloc and call these hooks; mutexes and exceptions cannot be monitored.

/// Declared in <sanitizer/allocator_interface.h>, which g++ does not provide.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void*, std::size_t),
                                                         void (*on_free)(const volatile void*));

namespace hapticd::test {

constinit const Sight kSight{.allocations = true,
                             .aligned_allocations = false,  // ThreadSanitizer calls no hook for them
                             .locks = false,
                             .exceptions = false,
                             .said_instead =
                                 "locks and exceptions: under this sanitizer they cannot be "
                                 "watched, builds without one (preset dev) do it"};

namespace {

void onMalloc(const volatile void*, std::size_t) {
  noteAllocation();
}
void onFree(const volatile void* memory) {
  if (memory != nullptr) noteAllocation();
}

[[maybe_unused]] const int installed = __sanitizer_install_malloc_and_free_hooks(onMalloc, onFree);

}  // namespace
}  // namespace hapticd::test
