// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// Thread: any.  RT: not safe.
namespace hapticd::tools::ros {

/// The topic in which programs of ROS 2 tell which node has which readers and writers.
inline constexpr const char* kDiscoveryTopic = "ros_discovery_info";

/// What hapticd-ros as a service publishes and takes, for `hapticctl ros`.
inline constexpr const char* kRosStatusFile = "/run/hapticd-ros/status.json";

/// Returns what is wrong with a namespace of ROS 2; empty: nothing is. A slash in front is taken away.
std::string namespaceProblem(std::string& name);

/// What hapticd-ros publishes and bags hold.
enum class Topic : std::uint8_t {
  measured_cp,
  measured_cv,
  setpoint_cf,
  operating_state,
  buttons,
  diagnostics,
  tf_static,
  points,
  depth_image,
  camera_info,
  fixtures,
  events,
};
inline constexpr std::size_t kTopicCount = 12;

struct TopicRow {
  Topic topic;
  std::string_view name;
  bool in_namespace;         ///< false: ROS 2 has one topic of that name for all
  std::string_view message;  ///< "geometry_msgs/PoseStamped"
  bool for_late;             ///< subscribers that come later get the last message, too
  int depth;                 ///< of messages that are kept until all subscribers have them
};
const TopicRow& rowOf(Topic topic);

/// Its name without the slash in front: "hapticd/measured_cp".
std::string nameOf(Topic topic, const std::string& name_space);

/// The name in DDS of a topic of ROS 2 without the slash in front: "rt/hapticd/measured_cp".
std::string ddsTopicName(const std::string& topic);

}  // namespace hapticd::tools::ros
