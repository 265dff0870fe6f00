// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/error.h"
#include "drivers/camera/recorded/recorded_frame.h"

namespace hapticd::drivers {

/// Name of the file that lists the frames in the folder of a recording with camera.yaml.
inline constexpr const char* kFrameFile = "frames.csv";

/// Largest size of an index; 1.6 million lines of 40 bytes.
inline constexpr std::size_t kMaxIndexBytes = 64 << 20;

/// Reads the frames that `folder`/frames.csv lists, of the form that README.md describes, and checks that
/// each file is in the folder itself. At least one frame, without host_ns. `cut_off`: why the last line was
/// left out, if it has no end and cannot be read. Errors: name the line and the remedy. Thread: any.  RT: not
/// safe.
config::Result<std::vector<RecordedFrame>> readFrameList(const std::filesystem::path& folder,
                                                         std::string& cut_off);

/// Returns the first line of such a file, with its end. `poses`: frames may have poses.
std::string frameListHeader(bool poses);
/// Returns the line of a frame for the same `poses`, with its end. Its host_ns does not count.
std::string frameListLine(const RecordedFrame& frame, bool poses);

}  // namespace hapticd::drivers
