// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/error.h"
#include "drivers/trace/records.h"

namespace hapticd::drivers {

/// A file kept inside a trace.
struct TraceAttachment {
  std::string name;
  std::string media_type;
  std::string data;
};

struct TraceOptions {
  bool compress = true;                   ///< chunks by zstd
  std::int64_t chunk_ns = 1'000'000'000;  ///< a chunk is written when there are messages of that much time
  /// The same of those before and with the first ticks: of a trace that breaks off before they are written
  /// nothing is left.
  std::int64_t first_chunk_ns = std::numeric_limits<std::int64_t>::max();
  /// CLOCK_REALTIME minus CLOCK_MONOTONIC at the start of the trace.
  std::int64_t realtime_offset_ns = 0;
  /// Name-value pairs of the metadata record "hapticd": versions, serial numbers, kernel, ...
  std::vector<std::pair<std::string, std::string>> metadata = {};
  std::vector<TraceAttachment> attachments = {};
  bool depth = false;  ///< it has a channel for raw depth frames
  /// What the camera's frames have in common: all of a header but times and number.
  rt::DepthFrameHeader depth_header = {};
};

/// Writes one trace: an MCAP file with ros2msg schemas and CDR messages (README.md has channels and fields).
/// While it is written its name ends in ".part"; close() gives it its own. What was written up to the last
/// whole chunk can be recovered after a crash (trace_recovery.h).
/// Thread: one.  RT: not safe (allocates, compresses, writes, waits for the disk).
class TraceWriter {
 public:
  /// `file`: the name after close(), ending in ".mcap"; neither it nor its ".part" exists.
  /// Errors: the folder is missing or not writable, no space.
  static config::Result<std::unique_ptr<TraceWriter>> create(const std::filesystem::path& file,
                                                             const TraceOptions& options);
  /// Leaves a ".part" behind if close() was not called.
  ~TraceWriter();

  // Each is kept until its chunk is complete, then the chunk is written, in the order of time, and
  // synchronised to the disk. Records may come a tenth of a chunk late without chunks that overlap in time.
  // Errors: what the disk says. The trace then ends with its last whole chunk: nothing more is written, and
  // close() still makes a readable file of it, once there is space for the summary.
  config::Result<void> write(const rt::Tick& tick);
  config::Result<void> write(const ModelRecord& model);
  config::Result<void> write(const DirectiveRecord& directive);
  config::Result<void> write(const EventRecord& event);
  config::Result<void> write(const SnapshotRecord& snapshot);
  /// Only where TraceOptions::depth says so.
  config::Result<void> write(const DepthRecord& depth);

  /// Writes all as a chunk, whatever its age.
  config::Result<void> flush();
  /// Writes chunk, summary and footer, and renames the file. Nothing may be written after it.
  config::Result<void> close();

  const std::filesystem::path& file() const noexcept;  ///< its name after close()
  std::uint64_t bytes() const noexcept;                ///< written so far
  std::uint64_t ticks() const noexcept;                ///< in whole chunks
  std::uint64_t ticksPending() const noexcept;         ///< in no chunk yet

 private:
  class Implementation;
  explicit TraceWriter(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hapticd::drivers
