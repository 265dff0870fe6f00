// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "rt/base/clock.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "tests/ros/ros_listener.h"

/// Messages of the scene, read by hand.
namespace hapticd::test {

/// The head of a message, as it came.
struct Header {
  std::int64_t time_ns = 0;
  std::string frame;
};
inline Header headerFrom(CdrBytes& bytes) {
  const std::int64_t seconds = bytes.number<std::int32_t>();
  const std::int64_t rest_ns = bytes.number<std::uint32_t>();
  return {seconds * rt::kNsPerSecond + rest_ns, bytes.text()};
}
inline rt::Vec3 vectorFrom(CdrBytes& bytes) {
  const double x = bytes.number<double>();
  const double y = bytes.number<double>();
  return {x, y, bytes.number<double>()};
}

/// The numbers of a list of bytes.
template <typename Number>
std::vector<Number> numbersFrom(const std::string& bytes) {
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return numbers;
}

/// sensor_msgs/PointCloud2, of which the points are as hapticd-ros states them.
struct CloudHeard {
  Header header;
  std::vector<float> xyz_m;
};
inline CloudHeard cloudFrom(const std::string& message) {
  CdrBytes bytes(message);
  CloudHeard cloud;
  cloud.header = headerFrom(bytes);
  EXPECT_EQ(bytes.number<std::uint32_t>(), 1U);  // a list, not an image
  const auto count = bytes.number<std::uint32_t>();
  EXPECT_EQ(bytes.number<std::uint32_t>(), 3U);
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(bytes.text(), std::string(1, static_cast<char>('x' + i)));
    EXPECT_EQ(bytes.number<std::uint32_t>(), 4 * i);
    EXPECT_EQ(bytes.number<std::uint8_t>(), 7U);  // FLOAT32
    EXPECT_EQ(bytes.number<std::uint32_t>(), 1U);
  }
  EXPECT_EQ(bytes.number<std::uint8_t>(), 0U);  // little-endian
  EXPECT_EQ(bytes.number<std::uint32_t>(), 12U);
  EXPECT_EQ(bytes.number<std::uint32_t>(), 12 * count);
  cloud.xyz_m = numbersFrom<float>(bytes.block());
  EXPECT_EQ(cloud.xyz_m.size(), std::size_t{3} * count);
  EXPECT_EQ(bytes.number<std::uint8_t>(), 1U);  // dense
  EXPECT_TRUE(bytes.ended());
  return cloud;
}

/// sensor_msgs/Image with the encoding 16UC1.
struct DepthHeard {
  Header header;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint16_t> depth_mm;
};
inline DepthHeard depthFrom(const std::string& message) {
  CdrBytes bytes(message);
  DepthHeard image;
  image.header = headerFrom(bytes);
  image.height = bytes.number<std::uint32_t>();
  image.width = bytes.number<std::uint32_t>();
  EXPECT_EQ(bytes.text(), "16UC1");
  EXPECT_EQ(bytes.number<std::uint8_t>(), 0U);  // little-endian
  EXPECT_EQ(bytes.number<std::uint32_t>(), 2 * image.width);
  image.depth_mm = numbersFrom<std::uint16_t>(bytes.block());
  EXPECT_EQ(image.depth_mm.size(), std::size_t{image.width} * image.height);
  EXPECT_TRUE(bytes.ended());
  return image;
}

/// sensor_msgs/CameraInfo up to the projection.
struct CameraHeard {
  Header header;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::string model;
  std::vector<double> d;
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
};
inline CameraHeard cameraFrom(const std::string& message) {
  CdrBytes bytes(message);
  CameraHeard camera;
  camera.header = headerFrom(bytes);
  camera.height = bytes.number<std::uint32_t>();
  camera.width = bytes.number<std::uint32_t>();
  camera.model = bytes.text();
  camera.d.resize(bytes.number<std::uint32_t>() % 100);
  for (double& number : camera.d) number = bytes.number<double>();
  for (double& number : camera.k) number = bytes.number<double>();
  for (double& number : camera.r) number = bytes.number<double>();
  for (double& number : camera.p) number = bytes.number<double>();
  return camera;
}

/// visualization_msgs/Marker, of what hapticd-ros fills in.
struct MarkerHeard {
  Header header;
  std::string name;
  std::int32_t id = 0;
  std::int32_t type = 0;
  std::int32_t action = 0;
  rt::RigidPose pose;
  rt::Vec3 scale_m;
  std::array<float, 4> colour{};
  std::vector<rt::Vec3> points_m;
  std::string text;
};
inline MarkerHeard markerFrom(CdrBytes& bytes) {
  MarkerHeard marker;
  marker.header = headerFrom(bytes);
  marker.name = bytes.text();
  marker.id = bytes.number<std::int32_t>();
  marker.type = bytes.number<std::int32_t>();
  marker.action = bytes.number<std::int32_t>();
  marker.pose.position_m_in_world = vectorFrom(bytes);
  rt::Quaternion& q = marker.pose.orientation;
  for (double* const part : {&q.x, &q.y, &q.z, &q.w}) *part = bytes.number<double>();
  marker.scale_m = vectorFrom(bytes);
  for (float& part : marker.colour) part = bytes.number<float>();
  for (int i = 0; i < 2; ++i) EXPECT_EQ(bytes.number<std::uint32_t>(), 0U);  // it does not end by itself
  EXPECT_EQ(bytes.number<std::uint8_t>(), 0U);
  for (auto count = bytes.number<std::uint32_t>() % 100'000; count > 0; --count)
    marker.points_m.push_back(vectorFrom(bytes));
  EXPECT_EQ(bytes.number<std::uint32_t>(), 0U);  // colours of points
  EXPECT_EQ(bytes.text(), "");                   // no texture
  EXPECT_EQ(headerFrom(bytes).frame, "");
  EXPECT_EQ(bytes.text(), "");
  EXPECT_EQ(bytes.block(), "");
  EXPECT_EQ(bytes.number<std::uint32_t>(), 0U);
  marker.text = bytes.text();
  EXPECT_EQ(bytes.text(), "");  // no mesh
  EXPECT_EQ(bytes.text(), "");
  EXPECT_EQ(bytes.block(), "");
  EXPECT_EQ(bytes.number<std::uint8_t>(), 0U);
  return marker;
}
/// visualization_msgs/MarkerArray.
inline std::vector<MarkerHeard> markersFrom(const std::string& message) {
  CdrBytes bytes(message);
  std::vector<MarkerHeard> markers(bytes.number<std::uint32_t>() % 10'000);
  for (MarkerHeard& marker : markers) marker = markerFrom(bytes);
  EXPECT_TRUE(bytes.ended());
  return markers;
}

/// tf2_msgs/TFMessage: of each frame, by its name, that of its parent and its pose there.
inline std::map<std::string, std::pair<std::string, rt::RigidPose>> framesFrom(const std::string& message) {
  CdrBytes bytes(message);
  std::map<std::string, std::pair<std::string, rt::RigidPose>> frames;
  for (auto count = bytes.number<std::uint32_t>() % 1000; count > 0; --count) {
    const Header header = headerFrom(bytes);
    auto& [parent, pose] = frames[bytes.text()];
    parent = header.frame;
    pose.position_m_in_world = vectorFrom(bytes);
    rt::Quaternion& q = pose.orientation;
    for (double* const part : {&q.x, &q.y, &q.z, &q.w}) *part = bytes.number<double>();
  }
  EXPECT_TRUE(bytes.ended());
  return frames;
}

}  // namespace hapticd::test
