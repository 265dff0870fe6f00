// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Marks a function that the force thread may call: it does not allocate, takes no lock, does not throw and
/// makes no system call except reading and sleeping on the clock. clang checks this; for g++ it means
/// `noexcept`.
///
/// Between HAPTICD_RT_TRUSTED_BEGIN and HAPTICD_RT_TRUSTED_END, clang does not check calls that it cannot
/// analyse; the reason is given there. RealtimeSanitizer still monitors them at run time.
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
