// SPDX-License-Identifier: Apache-2.0
// Hashes and names of types against those that ROS 2 has published.
#include "daemon/trace/ros/message_definitions.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "ros_messages.h"

namespace hapticd::trace::ros {
namespace {

/// Of ros2/common_interfaces and geometry2 as of 2024, and crtk_msgs as of 2026.
const std::map<std::string, std::string> kPublished{
    {"std_msgs/Header", "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"},
    {"geometry_msgs/PoseStamped", "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    {"geometry_msgs/TwistStamped", "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"},
    {"geometry_msgs/WrenchStamped", "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"},
    {"geometry_msgs/TransformStamped", "0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206"},
    {"sensor_msgs/Joy", "0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5"},
    {"diagnostic_msgs/DiagnosticArray", "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"tf2_msgs/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"crtk_msgs/OperatingState", "5cc57eea589b217fe5194bf2735b91d4a7f2dd5ac1245ae657f7ea7590c2c80e"},
    {"crtk_msgs/StringStamped", "83efb802e6596e03f69ac322e3231037329946f2bd13ed48874d97f5b8f5db1d"},
    {"crtk_msgs/CartesianImpedance", "9b4e8adf1c59d8045d9bab6c639f8851ec89024ff8bc744fb5b3965143dde7d0"},
    {"std_msgs/Bool", "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9"},
    {"sensor_msgs/JointState", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
    {"sensor_msgs/PointCloud2", "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
    {"sensor_msgs/Image", "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    {"sensor_msgs/CameraInfo", "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
    {"visualization_msgs/Marker", "45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0"},
    {"visualization_msgs/MarkerArray", "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"},
    {"rcl_interfaces/Log", "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac"},
    {"rmw_dds_common/ParticipantEntitiesInfo",
     "91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"}};

TEST(RosTypes, HaveTheHashesThatWerePublished) {
  for (const auto& [name, hash] : kPublished) EXPECT_EQ(typeHash(name), "RIHS01_" + hash) << name;
}

TEST(RosTypes, HaveTheNamesThatRos2GivesThemInDds) {
  const std::map<std::string, const dds_topic_descriptor_t*> types{
      {"geometry_msgs/PoseStamped", &geometry_msgs_msg_dds__PoseStamped__desc},
      {"geometry_msgs/TwistStamped", &geometry_msgs_msg_dds__TwistStamped__desc},
      {"geometry_msgs/WrenchStamped", &geometry_msgs_msg_dds__WrenchStamped__desc},
      {"sensor_msgs/Joy", &sensor_msgs_msg_dds__Joy__desc},
      {"diagnostic_msgs/DiagnosticArray", &diagnostic_msgs_msg_dds__DiagnosticArray__desc},
      {"tf2_msgs/TFMessage", &tf2_msgs_msg_dds__TFMessage__desc},
      {"crtk_msgs/OperatingState", &crtk_msgs_msg_dds__OperatingState__desc},
      {"crtk_msgs/StringStamped", &crtk_msgs_msg_dds__StringStamped__desc},
      {"crtk_msgs/CartesianImpedance", &crtk_msgs_msg_dds__CartesianImpedance__desc},
      {"std_msgs/Bool", &std_msgs_msg_dds__Bool__desc},
      {"sensor_msgs/JointState", &sensor_msgs_msg_dds__JointState__desc},
      {"sensor_msgs/PointCloud2", &sensor_msgs_msg_dds__PointCloud2__desc},
      {"sensor_msgs/Image", &sensor_msgs_msg_dds__Image__desc},
      {"sensor_msgs/CameraInfo", &sensor_msgs_msg_dds__CameraInfo__desc},
      {"visualization_msgs/MarkerArray", &visualization_msgs_msg_dds__MarkerArray__desc},
      {"rmw_dds_common/ParticipantEntitiesInfo", &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc}};
  for (const auto& [name, type] : types) {
    EXPECT_EQ(ddsTypeName(name), type->m_typename);
    EXPECT_EQ(type->type_information.sz, 0U) << name << " describes its type";
    EXPECT_EQ(type->m_nkeys, 0U) << name;
  }
  EXPECT_EQ(ddsTypeName("geometry_msgs/PoseStamped"), "geometry_msgs::msg::dds_::PoseStamped_");
}

TEST(RosTypes, AreCompleteWithAllThatIsInsideThem) {
  EXPECT_EQ(completeDefinition("sensor_msgs/Joy"),
            "std_msgs/Header header\nfloat32[] axes\nint32[] buttons\n" + std::string(80, '=') +
                "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + std::string(80, '=') +
                "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n");
  for (const MessageDefinition& message : messageDefinitions()) {
    EXPECT_NO_THROW((void)typeHash(message.name)) << message.name;
    EXPECT_FALSE(fieldsOf(message).empty()) << message.name;
  }
}

}  // namespace
}  // namespace hapticd::trace::ros
