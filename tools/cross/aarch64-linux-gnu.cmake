# SPDX-License-Identifier: Apache-2.0
# Builds for arm64 with Debian's cross compiler and the arm64 libraries of the same root (tools/cross-arm64).
# The programs that the build runs, such as those whose help becomes a manual page, run under qemu by binfmt_misc.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_STRIP aarch64-linux-gnu-strip)
set(ENV{PKG_CONFIG_LIBDIR} /usr/lib/aarch64-linux-gnu/pkgconfig:/usr/share/pkgconfig)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
