// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace hapticd::tools::ros {

/// The hash by which ROS 2 (from Iron on) tells whether both ends mean the same fields, RIHS01 of REP-2016:
/// "RIHS01_" and the SHA-256 of the description of the type in 64 hexadecimal digits. Names, types and order
/// of the fields enter, also of the messages inside; comments and constants do not.
/// `name`: of a message definition, "geometry_msgs/PoseStamped".
/// Thread: any.  RT: not safe.
std::string typeHash(std::string_view name);

}  // namespace hapticd::tools::ros
