// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/lib/client/varlink_client.h"
#include "tools/lib/ros/contents.h"

namespace hapticd::tools::ros {

/// The parameters that say where the handle's frame is.
Json handleFrameParameters();

/// The frames of camera and handle in the world, and the optical frame of the camera in its own: x right, y
/// down, z forward, as images and clouds of ROS 2 have it; as far as the replies tell: a member that is
/// missing or no number leaves its frame out. calibration: reply of GetCalibration; parameters: of
/// GetParameters with those above; prefix: of the names of the frames, "hapticd/".
std::vector<FixedFrame> fixedFrames(const Json& calibration, const Json& parameters,
                                    const std::string& prefix);

}  // namespace hapticd::tools::ros
