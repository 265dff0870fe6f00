// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/settings/settings.h"

namespace hapticd::drivers {

/// What a trace writes in an hour while it is recorded, if nothing of it can be compressed: an upper bound,
/// from the sizes of the records and how often they come, in bytes. Left out are events and changes of
/// parameters, fixtures and regions, which come when somebody causes them, and what the file system adds.
struct TraceVolume {
  std::uint64_t ticks = 0;   ///< ticks, models, snapshots of the core, and the frame of the file
  std::uint64_t scene = 0;   ///< the 3D picture without its clouds
  std::uint64_t depth = 0;   ///< raw depth frames
  std::uint64_t clouds = 0;  ///< the points within reach

  std::uint64_t total() const { return ticks + scene + depth + clouds; }
};

/// `settings`: trace.scene and `depth` (trace.depth, or what a client asked for) say what is recorded;
/// loop.rate_hz and rate and size of the camera's frames how much that is.
TraceVolume mostPerHour(const config::Settings& settings, bool depth);

/// Duration after which a trace goes on in another file: an hour is what a damaged file may cost.
inline constexpr double kMaxFile_s = 3600;

/// Time between two snapshots of the core in a trace, and the least time to the next one after a depth frame
/// that could not be recorded.
inline constexpr std::int64_t kSnapshotPeriod_ns = 10'000'000'000;
inline constexpr std::int64_t kMinSnapshotPeriod_ns = 1'000'000'000;

}  // namespace hapticd::drivers
