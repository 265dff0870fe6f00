// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>

#include "config/error.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/trace/depth_codec.h"
#include "rt/depth_frame.h"

namespace hapticd::tools {

/// The raw depth frames from which the scenes of a trace were built. A frame is known by its arrival,
/// CLOCK_MONOTONIC. Thread: one.
class TraceFrames {
 public:
  enum class State {
    missing,  ///< it was not recorded
    ahead,    ///< it is later in the file than the reading position
    here,
  };

  virtual ~TraceFrames() = default;
  virtual State stateOf(std::int64_t arrival_ns) const = 0;
  /// Only where stateOf() is `here`. Frames that arrived before it are not requested any more.
  virtual config::Result<void> read(std::int64_t arrival_ns, rt::DepthFrame& frame) = 0;
};

/// The frames in the trace itself, which are kept, still compressed, from when they are read to when the
/// ticks have come to them.
class FramesInTrace final : public TraceFrames {
 public:
  FramesInTrace(std::filesystem::path trace, std::set<std::int64_t> arrivals_ns)
      : trace_(std::move(trace)), arrivals_ns_(std::move(arrivals_ns)) {}

  /// Keeps the frame, and none that arrived before `needed_ns`.
  void add(const drivers::DepthRecord& record, std::int64_t needed_ns);
  /// Whether as many are kept as memory permits: half a minute, tens of megabytes where frames compress
  /// well.
  bool full() const { return kept_.size() > kMostKept; }

  State stateOf(std::int64_t arrival_ns) const override;
  config::Result<void> read(std::int64_t arrival_ns, rt::DepthFrame& frame) override;

 private:
  static constexpr std::size_t kMostKept = 1024;

  std::filesystem::path trace_;
  std::set<std::int64_t> arrivals_ns_;                 ///< of all that are in the file
  std::map<std::int64_t, drivers::DepthRecord> kept_;  ///< by arrival
  std::int64_t newest_read_ns_ = 0;
  drivers::DepthDecoder decoder_;
};

/// The frames of a recording in a folder, as older versions of hapticd recorded them.
class FramesInFolder final : public TraceFrames {
 public:
  FramesInFolder(drivers::RecordingReader recording, std::int64_t realtime_offset_ns);

  State stateOf(std::int64_t arrival_ns) const override;
  config::Result<void> read(std::int64_t arrival_ns, rt::DepthFrame& frame) override;

 private:
  drivers::RecordingReader recording_;
  std::map<std::int64_t, std::size_t> frames_;  ///< of the recording, by arrival
};

}  // namespace hapticd::tools
