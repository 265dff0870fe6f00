// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/messages/message_definitions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <stdexcept>

namespace hapticd::tools::ros {
namespace {

constexpr std::array kDefinitions{
    MessageDefinition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    MessageDefinition{"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    MessageDefinition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    MessageDefinition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    MessageDefinition{"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    MessageDefinition{"geometry_msgs/Pose",
                      "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    MessageDefinition{"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    MessageDefinition{"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    MessageDefinition{"geometry_msgs/TwistStamped", "std_msgs/Header header\ngeometry_msgs/Twist twist\n"},
    MessageDefinition{"geometry_msgs/Wrench", "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"},
    MessageDefinition{"geometry_msgs/WrenchStamped", "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n"},
    MessageDefinition{"geometry_msgs/Transform",
                      "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    MessageDefinition{"geometry_msgs/TransformStamped",
                      "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    MessageDefinition{"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    MessageDefinition{"sensor_msgs/Joy", "std_msgs/Header header\nfloat32[] axes\nint32[] buttons\n"},
    MessageDefinition{"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    MessageDefinition{"diagnostic_msgs/DiagnosticStatus",
                      "byte level\nstring name\nstring message\nstring hardware_id\n"
                      "diagnostic_msgs/KeyValue[] values\n"},
    MessageDefinition{"diagnostic_msgs/DiagnosticArray",
                      "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
    MessageDefinition{"crtk_msgs/OperatingState",
                      "std_msgs/Header header\nstring state\nbool is_homed\nbool is_busy\n"},
    MessageDefinition{"crtk_msgs/StringStamped", "std_msgs/Header header\nstring string\n"},
    MessageDefinition{"crtk_msgs/CartesianImpedanceHalfPlaneGains",
                      "geometry_msgs/Vector3 p\ngeometry_msgs/Vector3 d\ngeometry_msgs/Vector3 bias\n"
                      "geometry_msgs/Vector3 deadband\n"},
    MessageDefinition{"crtk_msgs/CartesianImpedance",
                      "std_msgs/Header header\n"
                      "geometry_msgs/Quaternion force_orientation\ngeometry_msgs/Vector3 force_position\n"
                      "geometry_msgs/Quaternion torque_orientation\n"
                      "crtk_msgs/CartesianImpedanceHalfPlaneGains position_positive\n"
                      "crtk_msgs/CartesianImpedanceHalfPlaneGains position_negative\n"
                      "crtk_msgs/CartesianImpedanceHalfPlaneGains orientation_positive\n"
                      "crtk_msgs/CartesianImpedanceHalfPlaneGains orientation_negative\n"},
    MessageDefinition{"std_msgs/Bool", "bool data\n"},
    MessageDefinition{"sensor_msgs/JointState",
                      "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
                      "float64[] effort\n"},
};

/// Types of the language itself have no package.
bool isMessage(std::string_view type) {
  return type.contains('/');
}

void addMessagesInside(std::string_view name, std::set<std::string_view>& inside) {
  for (const MessageField& field : fieldsOf(messageDefinition(name))) {
    if (isMessage(field.type) && inside.insert(field.type).second) addMessagesInside(field.type, inside);
  }
}

}  // namespace

std::span<const MessageDefinition> messageDefinitions() {
  return kDefinitions;
}

const MessageDefinition& messageDefinition(std::string_view name) {
  const auto found = std::ranges::find(kDefinitions, name, &MessageDefinition::name);
  if (found == kDefinitions.end()) throw std::logic_error(fmt::format("no message is called {}", name));
  return *found;
}

std::vector<MessageField> fieldsOf(const MessageDefinition& definition) {
  std::vector<MessageField> fields;
  for (std::string_view rest = definition.fields; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const std::size_t blank = line.find(' ');
    MessageField field{line.substr(0, blank), line.substr(blank + 1)};
    field.is_list = field.type.ends_with("[]");
    if (field.is_list) field.type.remove_suffix(2);
    fields.push_back(field);
  }
  return fields;
}

std::vector<std::string_view> messagesInside(std::string_view name) {
  std::set<std::string_view> inside;
  addMessagesInside(name, inside);
  return {inside.begin(), inside.end()};
}

std::string completeDefinition(std::string_view name) {
  std::string text(messageDefinition(name).fields);
  for (const std::string_view inside : messagesInside(name)) {
    text += fmt::format("{:=<80}\nMSG: {}\n{}", "", inside, messageDefinition(inside).fields);
  }
  return text;
}

std::string ddsTypeName(std::string_view name) {
  const std::size_t slash = name.find('/');
  return fmt::format("{}::msg::dds_::{}_", name.substr(0, slash), name.substr(slash + 1));
}

}  // namespace hapticd::tools::ros
