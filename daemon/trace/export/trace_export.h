// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "config/base/error.h"
#include "config/base/whole_file.h"
#include "daemon/trace/export/selected_trace.h"

namespace hapticd::trace {

/// A channel of a trace.
enum class TraceChannel { ticks, models, directives, events };

/// Writes one channel of `trace` as CSV (RFC 4180, with LF) into `csv`, and the configuration of the
/// recording into a file beside it. The header names each column with its unit at the end
/// (command_force_n_in_world_x); time_s counts from the first tick, realtime_s is UTC since 1970. Numbers
/// read back as the same values; enumerators by name; true and false as 1 and 0; empty where a field does not
/// apply (selected_trace.h). Each parameter of a directive has a column of its own. Returns the number of
/// rows without the header. The files are written completely or not at all. Errors: those of readTrace(), an
/// impossible selection (from_s after to_s, most_ticks 1), a file that exists and is not to be replaced or
/// cannot be written. Thread: any.  RT: not safe.
base::Result<std::uint64_t> exportCsv(const std::filesystem::path& trace, const std::filesystem::path& csv,
                                      TraceChannel channel, const TraceSelection& selection = {},
                                      const Progress& progress = {},
                                      base::IfExists if_exists = base::IfExists::refuse);

/// The file for the configuration: a.settings.yaml beside a.csv.
std::filesystem::path settingsBeside(const std::filesystem::path& csv);

/// Writes the raw depth frames of a trace as a recording, which the camera driver `recorded` plays: a folder
/// with a .pgm file for each frame. That of a Kinect v1 is in libfreenect's format, with INDEX.txt, which
/// `fakenect` plays too; that of any other camera has camera.yaml and frames.csv, where near_m, far_m and
/// what else the trace does not hold are left out. It gets its name when it is complete. Returns the number
/// of frames. Errors: those of readTrace(), no depth in the trace, the camera changes, the folder exists,
/// errors of the disk.
base::Result<std::uint64_t> exportRecording(const std::filesystem::path& trace,
                                            const std::filesystem::path& folder,
                                            const TraceSelection& selection, const Progress& progress);

}  // namespace hapticd::trace
