# SPDX-License-Identifier: Apache-2.0
# What shortens the build. Most of it was spent on headers: the standard library's and libfmt's take longer to read than
# what most files of ours contain, nlohmann's take as long again.
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)

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
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/headers.cpp "")
foreach(headers hapticd_headers hapticd_json_headers)
  add_library(${headers} OBJECT EXCLUDE_FROM_ALL ${CMAKE_CURRENT_BINARY_DIR}/headers.cpp)
  target_link_libraries(${headers} PRIVATE hapticd_options fmt::fmt)
  hapticd_precompile(${headers}
    <algorithm> <array> <chrono> <filesystem> <functional> <memory> <optional> <span> <string> <string_view> <thread> <vector>
    <fmt/format.h> <fmt/ranges.h>)
endforeach()
target_link_libraries(hapticd_json_headers PRIVATE nlohmann_json::nlohmann_json)
target_precompile_headers(hapticd_json_headers PRIVATE <nlohmann/json.hpp>)
