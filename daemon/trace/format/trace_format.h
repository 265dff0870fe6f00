// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/base/words.h"

namespace hapticd::trace {

/// CLOCK_REALTIME and what is known of it. A box without a battery for its clock starts with a time of the
/// past, until somebody or the network sets it.
struct WallClock {
  std::int64_t realtime_ns = 0;
  bool synchronised = false;     ///< with a clock of the network, according to the kernel
  bool kept_by_battery = false;  ///< set from a clock that goes on while the computer is off

  /// Reads it. `root`: where /sys is.
  static WallClock read(const std::filesystem::path& root = "/");

  /// Whether it tells the time, as far as can be known. `latest_ns`: a time that has certainly passed, such
  /// as that of the newest trace.
  bool isSet(std::int64_t latest_ns) const;
};

/// The channels of a trace for viewers. Their messages are ROS 2's own, in earlier traces those of Foxglove.
inline constexpr std::array<std::string_view, 3> kViewerTopics{"/hapticd/scene", "/hapticd/transforms",
                                                               "/hapticd/cloud_reach"};

/// Whether a channel is one of a trace: its topic is one of hapticd's, and its messages are none of ROS 2's
/// own but for viewers; a bag that was exported from a trace has others. `schema`: its name; empty: not
/// known.
inline bool isChannelOfTrace(std::string_view topic, std::string_view schema) {
  if (std::ranges::find(kViewerTopics, topic) != kViewerTopics.end()) return true;
  return topic.starts_with("/hapticd/") && (schema.empty() || schema.starts_with("hapticd_msgs/"));
}

/// Name of the metadata record of a bag of ROS 2.
inline constexpr std::string_view kBagMetadata = "rosbag2";

/// Name of the metadata record that identifies an MCAP file as a trace of hapticd.
inline constexpr std::string_view kTraceMetadata = "hapticd_trace";
inline constexpr std::string_view kVersionKey = "version";
inline constexpr std::string_view kTraceVersion = "1";
inline constexpr std::string_view kOffsetKey = "realtime_offset_ns";
/// Number of the trace in the order in which the box has begun its traces; left out: not numbered.
inline constexpr std::string_view kNumberKey = "number";
/// Whether CLOCK_REALTIME told the time when the trace began: kClockIsSet or another word; left out: not
/// known.
inline constexpr std::string_view kClockKey = "clock";
inline constexpr std::string_view kClockIsSet = "set";
inline constexpr std::string_view kClockIsNotSet = "not set";
/// Name of the metadata record with information about the writer.
inline constexpr std::string_view kOwnerMetadata = "hapticd";
inline constexpr std::string_view kWriterVersionKey = "hapticd_version";
/// Identifies a run of hapticd; the numbers of ticks, scenes and parameter sets restart in the next run.
inline constexpr std::string_view kRunKey = "run";

/// What the daemon does with the ticks of its force loop.
enum class TraceState {
  off,      ///< no trace was requested
  writing,  ///< ticks go into a file
  waiting,  ///< a trace was requested, but cannot be written now; it goes on by itself, in another file
};
constexpr auto wordsOf(TraceState) {
  return rt::words<TraceState>("off", "writing", "waiting");
}

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

}  // namespace hapticd::trace
