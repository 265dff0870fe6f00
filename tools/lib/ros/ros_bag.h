// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "config/base/error.h"
#include "config/base/whole_file.h"
#include "daemon/trace/export/selected_trace.h"

namespace hapticd::tools::ros {

/// What is in a bag.
struct BagContent {
  std::uint64_t messages = 0;
  std::uint64_t depth_frames = 0;  ///< each an image and a camera_info
};

/// Writes a trace as a bag of ROS 2: one MCAP file as rosbag2 writes and plays it, with the topics, types and
/// settings under which hapticd-ros publishes (docs/ros2.md). Times of messages and of their headers are
/// those of the measurement, in UTC. `name_space`: of topics and frames, without a slash in front, see
/// namespaceProblem(). The file is written completely or not at all.
/// Errors: those of readTrace(), an impossible selection, the trace has no ticks, damaged depth, a file that
/// exists and is not to be replaced or cannot be written.
/// Thread: any.  RT: not safe.
base::Result<BagContent> exportBag(const std::filesystem::path& trace, const std::filesystem::path& bag,
                                   const std::string& name_space, const trace::TraceSelection& selection = {},
                                   const trace::Progress& progress = {},
                                   base::IfExists if_exists = base::IfExists::refuse);

}  // namespace hapticd::tools::ros
