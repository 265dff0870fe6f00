// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hapticd::drivers {

/// What a trace, finished or not, says of itself in front of its first chunk.
struct TraceHead {
  bool depth = false;                     ///< contains raw depth, i.e. was begun with a channel for it
  std::uint64_t number = 0;               ///< see TraceOptions::number
  std::optional<bool> clock_is_set = {};  ///< see TraceOptions::clock_is_set; nothing: not known

  /// Takes number and clock from the metadata of the trace.
  void take(const std::vector<std::pair<std::string, std::string>>& metadata);
};

/// Reads the beginning of a file. Returns an empty head for a file that is not a trace, and for one of
/// another program that begins with its messages. Thread: any.  RT: not safe.
TraceHead readTraceHead(const std::filesystem::path& trace);

}  // namespace hapticd::drivers
