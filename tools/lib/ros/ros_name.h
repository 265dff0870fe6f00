// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

/// Thread: any.  RT: not safe.
namespace hapticd::tools::ros {

/// The topic in which programs of ROS 2 tell which node has which readers and writers.
inline constexpr const char* kDiscoveryTopic = "ros_discovery_info";

/// What hapticd-ros as a service publishes and takes, for `hapticctl ros`.
inline constexpr const char* kRosStatusFile = "/run/hapticd-ros/status.json";

/// Returns what is wrong with a namespace of ROS 2; empty: nothing is. A slash in front is taken away.
std::string namespaceProblem(std::string& name);

/// The name in DDS of a topic of ROS 2 without the slash in front: "rt/hapticd/measured_cp".
std::string ddsTopicName(const std::string& topic);

}  // namespace hapticd::tools::ros
