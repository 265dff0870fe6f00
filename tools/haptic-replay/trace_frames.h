// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "config/error.h"
#include "drivers/trace/depth_codec.h"
#include "rt/depth_frame.h"

namespace hapticd::tools {

/// The raw depth frames of a trace, from which its scenes were built. They are kept, still compressed, from
/// when they are read to when the ticks have come to them. A frame is known by its arrival, CLOCK_MONOTONIC.
/// Thread: one.
class TraceFrames {
 public:
  enum class State {
    missing,  ///< it was not recorded
    ahead,    ///< it is later in the file than the reading position
    here,
  };

  /// `arrivals_ns`: of all frames that are in the file.
  TraceFrames(std::filesystem::path trace, std::set<std::int64_t> arrivals_ns)
      : trace_(std::move(trace)), arrivals_ns_(std::move(arrivals_ns)) {}

  /// Keeps the frame, and none that arrived before `needed_ns`.
  void add(const drivers::DepthRecord& record, std::int64_t needed_ns);
  /// Whether as many are kept as memory permits: half a minute, tens of megabytes where frames compress
  /// well.
  bool full() const { return kept_.size() > kMostKept; }

  State stateOf(std::int64_t arrival_ns) const;
  /// Only where stateOf() is `here`. Frames that arrived before it are not requested any more.
  config::Result<void> read(std::int64_t arrival_ns, rt::DepthFrame& frame);

 private:
  static constexpr std::size_t kMostKept = 1024;

  std::filesystem::path trace_;
  std::set<std::int64_t> arrivals_ns_;
  std::map<std::int64_t, drivers::DepthRecord> kept_;  ///< by arrival
  std::int64_t newest_read_ns_ = 0;
  drivers::DepthDecoder decoder_;
};

}  // namespace hapticd::tools
