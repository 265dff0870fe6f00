// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "ros_messages.h"
#include "rt/base/clock.h"

/// Parts of samples for Cyclone DDS, which takes texts and lists as if it were to change them, and does not.
/// What they refer to stays valid until the sample has been written.
namespace hapticd::tools::ros {

inline char* borrowed(const std::string& text) {
  return const_cast<char*>(text.c_str());
}

/// Makes a list of a sample refer to elements elsewhere.
template <typename List, typename Element>
void lend(List& list, Element* elements, std::size_t count) {
  list._length = list._maximum = static_cast<std::uint32_t>(count);
  list._buffer = elements;
}

/// time_ns: UTC since 1970.
inline std_msgs_msg_dds__Header_ header(std::int64_t time_ns, const std::string& frame) {
  return {{static_cast<std::int32_t>(time_ns / rt::kNsPerSecond),
           static_cast<std::uint32_t>(time_ns % rt::kNsPerSecond)},
          borrowed(frame)};
}

}  // namespace hapticd::tools::ros
