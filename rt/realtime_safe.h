// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Marks a function that the force thread may call: it makes no allocation, takes no lock, throws nothing and
/// makes no system call but reading and sleeping on the clock. clang checks it, g++ keeps `noexcept`.
///
/// Between HAPTICD_RT_TRUSTED_BEGIN and HAPTICD_RT_TRUSTED_END clang takes our word for what it cannot look
/// into; the reason stands beside it. RealtimeSanitizer watches what runs there all the same.
#if defined(__clang__) && __has_cpp_attribute(clang::nonblocking)
#define HAPTICD_RT noexcept [[clang::nonblocking]]
#define HAPTICD_RT_TRUSTED_BEGIN                                                                    \
  _Pragma("clang diagnostic push") _Pragma("clang diagnostic ignored \"-Wunknown-warning-option\"") \
      _Pragma("clang diagnostic ignored \"-Wfunction-effects\"")
#define HAPTICD_RT_TRUSTED_END _Pragma("clang diagnostic pop")
#else
#define HAPTICD_RT noexcept
#define HAPTICD_RT_TRUSTED_BEGIN
#define HAPTICD_RT_TRUSTED_END
#endif
