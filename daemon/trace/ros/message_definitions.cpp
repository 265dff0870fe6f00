// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/ros/message_definitions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <stdexcept>

#include "config/base/sha256.h"

namespace hapticd::trace::ros {
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
    MessageDefinition{"sensor_msgs/Image",
                      "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
                      "uint8 is_bigendian\nuint32 step\nuint8[] data\n"},
    MessageDefinition{"sensor_msgs/RegionOfInterest",
                      "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    MessageDefinition{"sensor_msgs/CameraInfo",
                      "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
                      "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
                      "uint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"},
    MessageDefinition{"sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
    MessageDefinition{"sensor_msgs/PointCloud2",
                      "std_msgs/Header header\nuint32 height\nuint32 width\n"
                      "sensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n"
                      "uint32 row_step\nuint8[] data\nbool is_dense\n"},
    MessageDefinition{"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    MessageDefinition{"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"},
    MessageDefinition{"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
    MessageDefinition{"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"},
    MessageDefinition{"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
    MessageDefinition{
        "visualization_msgs/Marker",
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n"
        "geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\n"
        "bool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\n"
        "string texture_resource\nsensor_msgs/CompressedImage texture\n"
        "visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\n"
        "visualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n"},
    MessageDefinition{"visualization_msgs/MarkerArray", "visualization_msgs/Marker[] markers\n"},
    MessageDefinition{"rcl_interfaces/Log",
                      "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\n"
                      "string function\nuint32 line\n"},
    MessageDefinition{"rmw_dds_common/Gid", "char[16] data\n"},
    MessageDefinition{"rmw_dds_common/NodeEntitiesInfo",
                      "string<=256 node_namespace\nstring<=256 node_name\n"
                      "rmw_dds_common/Gid[] reader_gid_seq\nrmw_dds_common/Gid[] writer_gid_seq\n"},
    MessageDefinition{"rmw_dds_common/ParticipantEntitiesInfo",
                      "rmw_dds_common/Gid gid\n"
                      "rmw_dds_common/NodeEntitiesInfo[] node_entities_info_seq\n"},
    MessageDefinition{"sensor_msgs/JointState",
                      "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
                      "float64[] effort\n"},
};

/// The number that a text begins with; 0: with none.
std::uint32_t numberIn(std::string_view text) {
  std::uint32_t number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

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
    if (const std::size_t bound = field.type.find("<="); bound != field.type.npos) {
      field.longest_text = numberIn(field.type.substr(bound + 2));
      field.type = field.type.substr(0, bound);
    }
    if (const std::size_t bracket = field.type.find('['); bracket != field.type.npos) {
      field.elements = numberIn(field.type.substr(bracket + 1));
      field.is_list = field.elements == 0;
      field.type = field.type.substr(0, bracket);
    }
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

std::string fullTypeName(std::string_view name) {
  const std::size_t slash = name.find('/');
  return fmt::format("{}/msg/{}", name.substr(0, slash), name.substr(slash + 1));
}

std::string ddsTypeName(std::string_view name) {
  const std::size_t slash = name.find('/');
  return fmt::format("{}::msg::dds_::{}_", name.substr(0, slash), name.substr(slash + 1));
}

namespace {

/// Numbers of types as type_description_interfaces/msg/FieldType counts them; char is an alias of uint8.
struct TypeNumber {
  std::string_view type;
  int number;
};
constexpr int kMessage = 1;
constexpr int kBoundedString = 21;
/// To be added to the number of the elements.
constexpr int kArray = 48;
constexpr int kListOfAnyLength = 144;
constexpr std::array kTypeNumbers{
    TypeNumber{"int8", 2},     TypeNumber{"uint8", 3},    TypeNumber{"int16", 4}, TypeNumber{"uint16", 5},
    TypeNumber{"int32", 6},    TypeNumber{"uint32", 7},   TypeNumber{"int64", 8}, TypeNumber{"uint64", 9},
    TypeNumber{"float32", 10}, TypeNumber{"float64", 11}, TypeNumber{"char", 3},  TypeNumber{"bool", 15},
    TypeNumber{"byte", 16},    TypeNumber{"string", 17}};

int numberOfElement(const MessageField& field) {
  if (field.type.contains('/')) return kMessage;
  if (field.longest_text > 0) return kBoundedString;
  const auto found = std::ranges::find(kTypeNumbers, field.type, &TypeNumber::type);
  if (found == kTypeNumbers.end()) throw std::logic_error(fmt::format("no type is called {}", field.type));
  return found->number;
}

int numberOf(const MessageField& field) {
  const int list = field.is_list ? kListOfAnyLength : 0;
  return numberOfElement(field) + (field.elements > 0 ? kArray : list);
}

std::string fieldDescription(const MessageField& field) {
  return fmt::format(
      R"({{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
      field.name, numberOf(field), field.elements, field.longest_text,
      field.type.contains('/') ? fullTypeName(field.type) : "");
}

std::string messageDescription(std::string_view name) {
  std::string fields;
  for (const MessageField& field : fieldsOf(messageDefinition(name)))
    fields += (fields.empty() ? "" : ", ") + fieldDescription(field);
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", fullTypeName(name), fields);
}

}  // namespace

std::string typeHash(std::string_view name) {
  std::string inside;
  for (const std::string_view message : messagesInside(name))
    inside += (inside.empty() ? "" : ", ") + messageDescription(message);
  return "RIHS01_" +
         base::sha256(fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                                  messageDescription(name), inside));
}

}  // namespace hapticd::trace::ros
