// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hapticd::tools::ros {

/// Returns what is wrong with a namespace of ROS 2; empty: nothing is. A slash in front is taken away.
/// Thread: any.  RT: not safe.
std::string namespaceProblem(std::string& name);

}  // namespace hapticd::tools::ros
