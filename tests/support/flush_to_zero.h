// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__x86_64__)
#include <xmmintrin.h>
#elif !defined(__aarch64__)
#error "how this processor is told to flush subnormal numbers to zero is not known"
#endif

#include <cstdint>
#include <limits>

namespace hapticd::test {

/// Lets the calling thread's arithmetic replace subnormal numbers by zero, as a library linked with
/// -ffast-math does for the whole process.
inline void flushSubnormalsToZero() {
#if defined(__x86_64__)
  constexpr unsigned kFlushToZero = 1U << 15;
  constexpr unsigned kDenormalsAreZero = 1U << 6;
  _mm_setcsr(_mm_getcsr() | kFlushToZero | kDenormalsAreZero);
#else
  constexpr std::uint64_t kFlushToZero = std::uint64_t{1} << 24;
  std::uint64_t control = 0;
  asm volatile("mrs %0, fpcr" : "=r"(control));
  asm volatile("msr fpcr, %0" : : "r"(control | kFlushToZero));
#endif
}

/// Returns whether the calling thread's arithmetic keeps subnormal numbers.
inline bool keepsSubnormals() {
  volatile float smallest = std::numeric_limits<float>::min();
  volatile float half = 0.5F;
  volatile float subnormal = smallest * half;
  return subnormal * 2 == std::numeric_limits<float>::min();
}

}  // namespace hapticd::test
