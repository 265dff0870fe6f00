// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "config/base/error.h"
#include "daemon/trace/export/selected_trace.h"

namespace hapticd::trace {

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
