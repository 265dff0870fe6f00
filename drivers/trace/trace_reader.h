// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/error.h"
#include "drivers/trace/records.h"
#include "drivers/trace/trace_writer.h"

namespace hapticd::drivers {

/// Names and values.
using TraceText = std::vector<std::pair<std::string, std::string>>;

/// What a trace says of itself.
struct TraceInfo {
  std::uint64_t bytes = 0;
  std::uint64_t ticks = 0;
  std::uint64_t ticks_dropped = 0;  ///< missing between the first and the last one
  std::uint64_t models = 0;
  std::uint64_t directives = 0;
  std::uint64_t events = 0;
  std::uint64_t snapshots = 0;
  std::uint64_t depth_frames = 0;
  std::uint64_t chunks = 0;
  std::int64_t first_ns = 0;  ///< CLOCK_REALTIME of the first message
  std::int64_t last_ns = 0;
  std::int64_t realtime_offset_ns = 0;  ///< CLOCK_REALTIME minus CLOCK_MONOTONIC
  bool complete = false;                ///< closed properly: summary and footer are there
  TraceText metadata;
  std::vector<TraceAttachment> attachments;
  /// Fields that its records do not have, by the topic: it is of another version of hapticd.
  std::map<std::string, std::vector<std::string>, std::less<>> missing;

  /// Its channels that this version knows; programs that filter files leave some out.
  std::set<std::string, std::less<>> topics;

  bool lacks(std::string_view topic, std::string_view field) const;
  /// Errors: the trace `file` has no such channel.
  config::Result<void> require(const std::filesystem::path& file, std::string_view topic) const;
};

/// Gets what a trace holds, in the order of the messages' times in the file (log_time), whatever their order
/// in it; what is not set is skipped. False ends the reading.
struct TraceVisitor {
  std::function<bool(const rt::Tick&)> tick = {};
  std::function<bool(const ModelRecord&)> model = {};
  std::function<bool(const DirectiveRecord&)> directive = {};
  std::function<bool(const EventRecord&)> event = {};
  std::function<bool(const SnapshotRecord&)> snapshot = {};
  /// Its header is one that this version reads; the image is still encoded (depth_codec.h).
  std::function<bool(const DepthRecord&)> depth = {};
  /// Share of the file that has been read, 0..1, now and then.
  std::function<void(double)> progress = {};
};

/// Reads a trace from its begin to its end with all checksums; metadata and attachments are in the result.
/// Traces that other programs have rewritten, filtered or merged are read like any other, as long as they are
/// of one run of hapticd. Other versions have other fields: those that this one does not know are left out,
/// and what MessageDecoder says holds for those that are missing. Errors: no such file, no MCAP file, no
/// trace of hapticd, of a version that this one does not read (another format, or a field of another type),
/// merged of several runs of hapticd, a checksum that does not fit (with the place), cut off (a ".part" or a
/// damaged end: what was whole has been visited by then; recover it). Thread: any.
config::Result<TraceInfo> readTrace(const std::filesystem::path& file, const TraceVisitor& visitor = {});

}  // namespace hapticd::drivers
