// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// Reads a pose from a line of text: x,y,z,qx,qy,qz,qw[,age] with commas or blanks between, or a JSON object
/// with members of FeedPose. Returns the parameters of FeedPose without the frame; null for a line without
/// content. Errors: what is wrong with the line.
std::expected<Json, std::string> poseFromLine(const std::string& line);

}  // namespace hapticd::tools
