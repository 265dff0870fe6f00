// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::test {

/// Whether this build uses ThreadSanitizer.
#if defined(__SANITIZE_THREAD__)
inline constexpr bool kThreadSanitizer = true;
#elif defined(__has_feature)
inline constexpr bool kThreadSanitizer = __has_feature(thread_sanitizer);
#else
inline constexpr bool kThreadSanitizer = false;
#endif

/// Whether this build uses a sanitizer that takes memory of its own.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kMemoryOfSanitizer = true;
#elif defined(__has_feature)
inline constexpr bool kMemoryOfSanitizer = kThreadSanitizer || __has_feature(address_sanitizer);
#else
inline constexpr bool kMemoryOfSanitizer = kThreadSanitizer;
#endif

}  // namespace hapticd::test
