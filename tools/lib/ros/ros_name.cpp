// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/ros_name.h"

#include <fmt/format.h>

#include <array>

#include "config/base/value_text.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::size_t kLongestNamespace = 200;

/// Ten messages are kept of what ROS 2 keeps as many of by default, and one where the newest is all.
constexpr std::array<TopicRow, kTopicCount> kTopics{{
    {Topic::measured_cp, "measured_cp", true, "geometry_msgs/PoseStamped", false, 10},
    {Topic::measured_cv, "measured_cv", true, "geometry_msgs/TwistStamped", false, 10},
    {Topic::setpoint_cf, "setpoint_cf", true, "geometry_msgs/WrenchStamped", false, 10},
    {Topic::operating_state, "operating_state", true, "crtk_msgs/OperatingState", true, 1},
    {Topic::buttons, "buttons", true, "sensor_msgs/Joy", false, 10},
    {Topic::diagnostics, "diagnostics", false, "diagnostic_msgs/DiagnosticArray", false, 10},
    {Topic::tf_static, "tf_static", false, "tf2_msgs/TFMessage", true, 1},
    {Topic::points, "scene/points", true, "sensor_msgs/PointCloud2", false, 1},
    {Topic::depth_image, "depth/image_raw", true, "sensor_msgs/Image", false, 1},
    {Topic::camera_info, "depth/camera_info", true, "sensor_msgs/CameraInfo", false, 1},
    {Topic::fixtures, "fixtures", true, "visualization_msgs/MarkerArray", true, 1},
    {Topic::events, "events", true, "rcl_interfaces/Log", false, 10},
}};
constexpr bool topicsAreInOrder() {
  for (std::size_t i = 0; i < kTopics.size(); ++i) {
    if (static_cast<std::size_t>(kTopics[i].topic) != i) return false;
  }
  return true;
}
static_assert(topicsAreInOrder());

bool isLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace

std::string namespaceProblem(std::string& name) {
  if (name.starts_with('/')) name.erase(0, 1);
  bool begins = true;
  bool good = name.size() <= kLongestNamespace;
  for (const char c : name) {
    good = good && (begins ? isLetter(c) : isLetter(c) || isDigit(c) || c == '/');
    begins = c == '/';
  }
  if (good && !begins) return "";
  return fmt::format(
      "{} must be names of letters, digits and underscores, with / between them, at most {} in all",
      base::inQuotes(name), kLongestNamespace);
}

const TopicRow& rowOf(Topic topic) {
  return kTopics[static_cast<std::size_t>(topic)];
}

std::string nameOf(Topic topic, const std::string& name_space) {
  const TopicRow& row = rowOf(topic);
  return row.in_namespace ? fmt::format("{}/{}", name_space, row.name) : std::string(row.name);
}

std::string ddsTopicName(const std::string& topic) {
  return topic == kDiscoveryTopic ? topic : "rt/" + topic;
}

}  // namespace hapticd::tools::ros
