#pragma once

/// Marks a function that the force thread may call: it makes no allocation, takes no lock, throws nothing and
/// makes no system call but reading and sleeping on the clock. clang checks it, g++ keeps `noexcept`.
#if defined(__clang__) && __has_cpp_attribute(clang::nonblocking)
#define HAPTICD_RT noexcept [[clang::nonblocking]]
#else
#define HAPTICD_RT noexcept
#endif
