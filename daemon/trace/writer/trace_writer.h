// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "daemon/trace/format/records.h"

namespace hapticd::trace {

/// Options of a TraceWriter.
struct TraceOptions {
  bool compress = true;                   ///< compress chunks with zstd
  std::int64_t chunk_ns = 1'000'000'000;  ///< duration of a chunk
  /// Duration of the first chunk, which contains the first ticks: nothing is left of a trace that ends before
  /// it is written.
  std::int64_t first_chunk_ns = std::numeric_limits<std::int64_t>::max();
  /// CLOCK_REALTIME minus CLOCK_MONOTONIC at the start of the trace.
  std::int64_t realtime_offset_ns = 0;
  /// Whether CLOCK_REALTIME told the time then (trace_format.h); nothing: not known.
  std::optional<bool> clock_is_set = {};
  /// Counts the traces of a box in the order in which they begin, whatever its clock says; 0: not numbered.
  std::uint64_t number = 0;
  /// Name-value pairs of the metadata record "hapticd": versions, serial numbers, kernel, ...
  std::vector<std::pair<std::string, std::string>> metadata = {};
  std::vector<TraceAttachment> attachments = {};
  bool depth = false;  ///< include a channel for raw depth frames
  /// Include the channels for the 3D picture (daemon/trace/ros/scene_picture.h): kSceneRate_hz times a second
  /// a scene made from the records, and every second the camera's pose from `depth_header`.
  bool scene = false;
  bool cloud = false;  ///< include a channel for the points that the hand can reach
  /// Header fields shared by all frames of the camera: all except times and number.
  rt::DepthFrameHeader depth_header = {};
};

inline constexpr std::int64_t kSceneRate_hz = 30;

/// Writes one trace: an MCAP file with ros2msg schemas and CDR messages (README.md lists channels and
/// fields). While it is being written its name ends in ".part"; close() gives it its final name. After a
/// crash, everything up to the last complete chunk can be recovered (trace_recovery.h).
/// Thread: one.  RT: not safe (allocates, compresses, writes, waits for the disk).
class TraceWriter {
 public:
  /// Creates a trace. `file`: its name after close(), ending in ".mcap"; neither it nor its ".part" may
  /// exist.
  /// Errors: the folder is missing or not writable, no space.
  static base::Result<std::unique_ptr<TraceWriter>> create(const std::filesystem::path& file,
                                                           const TraceOptions& options);
  /// Leaves a ".part" behind if close() was not called.
  ~TraceWriter();

  // Each record is held until its chunk is complete; the chunk is then written in time order and synchronised
  // to disk. Records may arrive a tenth of a chunk late; one that is later still keeps its own time, but its
  // message takes its place (log_time) behind what is on the disk, so that chunks never overlap in time.
  // Errors: disk errors. The trace then ends with its last complete chunk: nothing more is written, but
  // close() still makes it a readable file once there is space for the summary.
  /// `record`: an rt::Tick or a record of records.h; a DepthRecord only if TraceOptions::depth is set, and a
  /// CloudRecord only if TraceOptions::cloud is.
  template <typename Record>
  base::Result<void> write(const Record& record);

  /// Writes all pending records as a chunk, whatever its duration.
  base::Result<void> flush();
  /// Writes chunk, summary and footer, and renames the file. Nothing may be written afterwards.
  base::Result<void> close();

  const std::filesystem::path& file() const noexcept;  ///< its name after close()
  std::uint64_t bytes() const noexcept;                ///< written so far
  std::uint64_t ticks() const noexcept;                ///< in complete chunks
  std::uint64_t ticksPending() const noexcept;         ///< not in a chunk yet

 private:
  class Implementation;
  explicit TraceWriter(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

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

}  // namespace hapticd::trace
