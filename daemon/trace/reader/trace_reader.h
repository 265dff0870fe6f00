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

#include "config/base/error.h"
#include "daemon/trace/format/records.h"

namespace hapticd::trace {

/// Pairs of names and values.
using TraceText = std::vector<std::pair<std::string, std::string>>;

/// General information about a trace.
struct TraceInfo {
  std::uint64_t bytes = 0;
  std::uint64_t ticks = 0;
  std::uint64_t ticks_dropped = 0;  ///< missing between the first and the last one
  std::uint64_t models = 0;
  std::uint64_t directives = 0;
  std::uint64_t additions = 0;
  std::uint64_t poses = 0;
  std::uint64_t events = 0;
  std::uint64_t snapshots = 0;
  std::uint64_t depth_frames = 0;
  std::uint64_t chunks = 0;
  std::int64_t first_ns = 0;  ///< CLOCK_REALTIME of the first message
  std::int64_t last_ns = 0;
  std::int64_t realtime_offset_ns = 0;    ///< CLOCK_REALTIME minus CLOCK_MONOTONIC
  std::optional<bool> clock_is_set = {};  ///< whether that clock told the time; nothing: not known
  bool metadata_lost = false;  ///< removed by another program; the offset is that of the first record
  bool complete = false;       ///< closed properly: summary and footer are present
  TraceText metadata;
  std::vector<TraceAttachment> attachments;
  /// Fields missing in its records, by topic, because it was written by another version of hapticd.
  std::map<std::string, std::vector<std::string>, std::less<>> missing;

  /// Its channels known to this version; programs that filter files may remove some.
  std::set<std::string, std::less<>> topics;

  bool lacks(std::string_view topic, std::string_view field) const;
  /// Errors: the trace `file` has no such channel.
  base::Result<void> require(const std::filesystem::path& file, std::string_view topic) const;
};

/// Receives the records of a trace in the order of the messages' times (log_time). Functions that are not set
/// skip their records. Returning false stops reading.
struct TraceVisitor {
  std::function<bool(const rt::Tick&)> tick = {};
  std::function<bool(const ModelRecord&)> model = {};
  std::function<bool(const DirectiveRecord&)> directive = {};
  std::function<bool(const AdditionsRecord&)> additions = {};
  std::function<bool(const PoseRecord&)> pose = {};
  std::function<bool(const EventRecord&)> event = {};
  std::function<bool(const SnapshotRecord&)> snapshot = {};
  /// The header is readable by this version; the image is still encoded (depth_codec.h).
  std::function<bool(const DepthRecord&)> depth = {};
  /// Called occasionally with the fraction of the file that has been read, 0..1.
  std::function<void(double)> progress = {};
};

/// Reads a trace from beginning to end and verifies all checksums; metadata and attachments are in the
/// result. Traces rewritten, filtered or merged by other programs are read as well, as long as they are from
/// one run of hapticd. Other versions may have other fields: unknown ones are ignored, and missing ones are
/// handled as described at MessageDecoder. A file from which another program has removed the metadata is
/// recognised by its channels.
/// Errors: no such file, not an MCAP file, not a trace of hapticd, an unreadable version (another format, or
/// a field of another type), a merge of several runs of hapticd, messages out of the order of time, a
/// checksum mismatch (with its offset), a truncated file (a ".part" or a damaged end; the intact part has
/// been visited by then). Thread: any.
base::Result<TraceInfo> readTrace(const std::filesystem::path& file, const TraceVisitor& visitor = {});

}  // namespace hapticd::trace
