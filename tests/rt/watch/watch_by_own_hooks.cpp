// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

#include "tests/rt/watch/watch.h"

// This program's own malloc, pthread_mutex_lock etc. take precedence over those of the C library, including
// for the libraries that it is linked with. They record the call and forward it.

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);
}

namespace hapticd::test {

constinit const Sight kSight{
    .allocations = true, .aligned_allocations = true, .locks = true, .exceptions = true, .said_instead = ""};

namespace {

/// Returns the function that would be called without this hook.
template <typename Function>
Function* next(std::atomic<Function*>& known, const char* name) noexcept {
  Function* function = known.load(std::memory_order_relaxed);
  if (function == nullptr) {
    function = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
    known.store(function, std::memory_order_relaxed);
  }
  return function;
}

using MutexFunction = int(pthread_mutex_t*);
using ReadWriteLockFunction = int(pthread_rwlock_t*);
using ThrowFunction = void(void*, void*, void (*)(void*));
constinit std::atomic<MutexFunction*> next_mutex_lock{nullptr};
constinit std::atomic<MutexFunction*> next_mutex_trylock{nullptr};
constinit std::atomic<ReadWriteLockFunction*> next_read_lock{nullptr};
constinit std::atomic<ReadWriteLockFunction*> next_write_lock{nullptr};
constinit std::atomic<ThrowFunction*> next_throw{nullptr};

}  // namespace
}  // namespace hapticd::test

using namespace hapticd::test;

extern "C" {

void* malloc(std::size_t size) noexcept {
  noteAllocation();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  noteAllocation();
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  noteAllocation();
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  noteAllocation();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  noteAllocation();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  noteAllocation();
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
void free(void* memory) noexcept {
  if (memory != nullptr) noteAllocation();
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  noteLock();
  return next(next_mutex_lock, "pthread_mutex_lock")(mutex);
}
int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  noteLock();
  return next(next_mutex_trylock, "pthread_mutex_trylock")(mutex);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  noteLock();
  return next(next_read_lock, "pthread_rwlock_rdlock")(lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  noteLock();
  return next(next_write_lock, "pthread_rwlock_wrlock")(lock);
}

// Declared as by the compiler itself where a header throws: the type information is untyped.
[[noreturn]] void __cxa_throw(void* object, void* type, void (*destructor)(void*)) {
  noteException();
  next(next_throw, "__cxa_throw")(object, type, destructor);
  std::abort();
}

}  // extern "C"
