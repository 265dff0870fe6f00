// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "config/error.h"
#include "tools/lib/trace/trace_selection.h"

namespace hapticd::tools {

/// Writes the raw depth frames of a trace as a recording in libfreenect's format, which `fakenect` and the
/// camera driver `recorded` play: a folder with INDEX.txt and a .pgm file for each frame. It gets its name
/// when it is complete. Returns the number of frames. Errors: those of readTrace(), no depth in the trace,
/// the folder exists, errors of the disk.
config::Result<std::uint64_t> exportRecording(const std::filesystem::path& trace,
                                              const std::filesystem::path& folder,
                                              const TraceSelection& selection, const Progress& progress);

}  // namespace hapticd::tools
