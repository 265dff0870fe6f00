// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace hapticd::drivers {

/// Whether a topic is one of hapticd's.
inline bool isTopicOfHapticd(std::string_view topic) {
  return topic.starts_with("/hapticd/");
}

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

}  // namespace hapticd::drivers
