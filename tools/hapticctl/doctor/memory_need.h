// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/settings/settings.h"

namespace hapticd::tools {

/// The memory that hapticd takes, and locks where that is permitted, by what it depends on; in bytes. Sizes
/// of structures and buffers times what the configuration says, and for what lies between them figures that
/// were measured on the running daemon; daemon_memory_test compares the sum with the daemon for several
/// configurations.
struct MemoryNeed {
  std::uint64_t program = 0;  ///< code, libraries, heap, drivers; rings of ticks
  std::uint64_t stacks = 0;   ///< of the threads: locked as a whole
  std::uint64_t points = 0;   ///< grid.point_capacity
  std::uint64_t frames = 0;   ///< depth frames and what is kept of each pixel
  std::uint64_t ticks = 0;    ///< trace.flight_recorder_s
  std::uint64_t depth = 0;    ///< frames that wait for their compression and for the disk, with trace.depth

  std::uint64_t total() const { return program + stacks + points + frames + ticks + depth; }
};

MemoryNeed memoryNeed(const config::Settings& settings);

}  // namespace hapticd::tools
