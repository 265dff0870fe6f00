# SPDX-License-Identifier: Apache-2.0
# What shortens the build. Most of it was spent on headers: the standard library's and libfmt's take longer to read than
# what most files of ours contain, nlohmann's take as long again.
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)

# What is built and linked does not depend on what this machine happens to have. Only the compiler's cache, which changes
# nothing of the result, is used where it is installed. It accepts precompiled headers of g++ only with -fpch-preprocess,
# and trusts them only if it may ignore macros that were defined before them; there are none. An empty cache would cost a
# seventh of the build: with CCACHE_DEPEND it takes the compiler's list of headers and does not preprocess each file
# itself, and with CCACHE_INODECACHE it reads a precompiled header of 100 MB once and not for each file.
find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
      env CCACHE_DEPEND=1 CCACHE_INODECACHE=1 CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
  add_compile_options($<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)
endif()

# hapticd_precompile(target HEADERS..) or (target REUSE_FROM another): compiles these headers once.
function(hapticd_precompile target)
  if(ARGV1 STREQUAL REUSE_FROM)
    target_precompile_headers(${target} REUSE_FROM ${ARGV2})
  else()
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
  # out of a precompiled header g++ 12 takes system headers for ours, and sees overruns that are not there
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread>)
endfunction()

# hapticd_headers is for targets that link fmt::fmt, hapticd_json_headers for those that link nlohmann_json as well:
# `hapticd_precompile(target REUSE_FROM hapticd_headers)`.
file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/headers.cpp CONTENT "")  # untouched where it exists
foreach(headers hapticd_headers hapticd_json_headers)
  add_library(${headers} OBJECT EXCLUDE_FROM_ALL ${CMAKE_CURRENT_BINARY_DIR}/headers.cpp)
  target_link_libraries(${headers} PRIVATE hapticd_options fmt::fmt)
  hapticd_precompile(${headers}
    <algorithm> <array> <chrono> <filesystem> <functional> <memory> <optional> <span> <string> <string_view> <thread> <vector>
    <fmt/format.h> <fmt/ranges.h>)
endforeach()
target_link_libraries(hapticd_json_headers PRIVATE nlohmann_json::nlohmann_json)
target_precompile_headers(hapticd_json_headers PRIVATE <nlohmann/json.hpp>)
