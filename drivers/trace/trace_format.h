// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace hapticd::drivers {

/// Metadata record that makes an MCAP file a trace of hapticd.
inline constexpr std::string_view kTraceMetadata = "hapticd_trace";
inline constexpr std::string_view kVersionKey = "version";
inline constexpr std::string_view kTraceVersion = "1";
inline constexpr std::string_view kOffsetKey = "realtime_offset_ns";
/// Metadata record with what its writer wants to say.
inline constexpr std::string_view kOwnerMetadata = "hapticd";
inline constexpr std::string_view kWriterVersionKey = "hapticd_version";
/// Of one run of hapticd: ticks, scenes and parameter sets are numbered anew in the next one.
inline constexpr std::string_view kRunKey = "run";

}  // namespace hapticd::drivers
