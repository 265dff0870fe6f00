// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/scene/scene_topics.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <utility>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "tools/hapticd-ros/dds/sample_parts.h"

namespace hapticd::tools::ros {
namespace {

using Late = Publisher::Late;

/// So long a message may be on its way to one subscriber before the others get the next one all the same.
constexpr std::int64_t kLongestWay_ns = rt::kNsPerSecond;

std::uint8_t* borrowedBytes(const void* bytes) {
  return const_cast<std::uint8_t*>(static_cast<const std::uint8_t*>(bytes));
}

}  // namespace

SceneTopics::SceneTopics(Publisher points, Publisher image, Publisher camera_info, Publisher fixtures,
                         const std::string& name_space)
    : points_{std::move(points)},
      image_{std::move(image)},
      camera_info_(std::move(camera_info)),
      fixtures_(std::move(fixtures)),
      optical_frame_(name_space + "/camera_optical"),
      world_frame_(name_space + "/world") {}

base::Result<SceneTopics> SceneTopics::open(const Participant& participant, const std::string& name_space) {
  auto points = Publisher::open(participant, name_space + "/scene/points", "sensor_msgs/PointCloud2",
                                sensor_msgs_msg_dds__PointCloud2__desc, Late::gets_nothing);
  if (!points) return std::unexpected(points.error());
  auto image = Publisher::open(participant, name_space + "/depth/image_raw", "sensor_msgs/Image",
                               sensor_msgs_msg_dds__Image__desc, Late::gets_nothing);
  if (!image) return std::unexpected(image.error());
  auto camera_info = Publisher::open(participant, name_space + "/depth/camera_info", "sensor_msgs/CameraInfo",
                                     sensor_msgs_msg_dds__CameraInfo__desc, Late::gets_nothing);
  if (!camera_info) return std::unexpected(camera_info.error());
  auto fixtures = Publisher::open(participant, name_space + "/fixtures", "visualization_msgs/MarkerArray",
                                  visualization_msgs_msg_dds__MarkerArray__desc, Late::gets_last);
  if (!fixtures) return std::unexpected(fixtures.error());
  return SceneTopics(std::move(*points), std::move(*image), std::move(*camera_info), std::move(*fixtures),
                     name_space);
}

bool SceneTopics::mayFollow(Outgoing& outgoing) {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  const bool may = outgoing.publisher.isAcknowledged(std::chrono::nanoseconds(0)) ||
                   now_ns - outgoing.written_ns > kLongestWay_ns;
  if (may) outgoing.written_ns = now_ns;
  return may;
}

bool SceneTopics::points(std::int64_t time_ns, std::span<const float> xyz_m) {
  constexpr std::uint8_t kFloat32 = 7;
  constexpr std::uint32_t kPointBytes = 3 * sizeof(float);
  std::array<std::string, 3> names{"x", "y", "z"};
  std::array<sensor_msgs_msg_dds__PointField_, 3> fields{};
  for (std::uint32_t i = 0; i < fields.size(); ++i)
    fields[i] = {borrowed(names[i]), static_cast<std::uint32_t>(i * sizeof(float)), kFloat32, 1};
  sensor_msgs_msg_dds__PointCloud2_ sample{};
  sample.header = header(time_ns, optical_frame_);
  sample.height = 1;
  sample.width = static_cast<std::uint32_t>(xyz_m.size() / 3);
  lend(sample.fields, fields.data(), fields.size());
  sample.point_step = kPointBytes;
  sample.row_step = kPointBytes * sample.width;
  lend(sample.data, borrowedBytes(xyz_m.data()), sample.row_step);
  sample.is_dense = true;
  return points_.publisher.write(&sample);
}

bool SceneTopics::image(std::int64_t time_ns, const DepthImage& image) {
  const std::string encoding = "16UC1";
  sensor_msgs_msg_dds__Image_ sample{};
  sample.header = header(time_ns, optical_frame_);
  sample.height = image.height_px;
  sample.width = image.width_px;
  sample.encoding = borrowed(encoding);
  sample.step = static_cast<std::uint32_t>(sizeof(std::uint16_t)) * image.width_px;
  lend(sample.data, borrowedBytes(image.depth_mm.data()), std::size_t{sample.step} * sample.height);
  return image_.publisher.write(&sample);
}

bool SceneTopics::cameraInfo(std::int64_t time_ns, const PinholeCamera& camera) {
  const std::string model = "plumb_bob";
  std::array<double, 5> no_distortion{};
  sensor_msgs_msg_dds__CameraInfo_ sample{};
  sample.header = header(time_ns, optical_frame_);
  sample.height = camera.height_px;
  sample.width = camera.width_px;
  sample.distortion_model = borrowed(model);
  lend(sample.d, no_distortion.data(), no_distortion.size());
  const auto& [width, height, fx, fy, cx, cy] = camera;
  std::ranges::copy(std::array<double, 9>{fx, 0, cx, 0, fy, cy, 0, 0, 1}, sample.k);
  std::ranges::copy(std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1}, sample.r);
  std::ranges::copy(std::array<double, 12>{fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0}, sample.p);
  return camera_info_.write(&sample);
}

namespace {

/// visualization_msgs/Marker: add or change, and delete all.
constexpr std::int32_t kAdd = 0;
constexpr std::int32_t kDeleteAll = 3;

using Points = std::vector<geometry_msgs_msg_dds__Point_>;

/// A marker with all its texts; empty ones are not null.
visualization_msgs_msg_dds__Marker_ emptyMarker(std::int64_t time_ns, const std::string& frame,
                                                const std::string& nothing) {
  visualization_msgs_msg_dds__Marker_ marker{};
  marker.header = header(time_ns, frame);
  marker.texture.header = header(0, nothing);
  marker.pose.orientation.w = 1;
  for (char** const text : {&marker.ns, &marker.texture_resource, &marker.texture.format, &marker.text,
                            &marker.mesh_resource, &marker.mesh_file.filename})
    *text = borrowed(nothing);
  return marker;
}

void fill(visualization_msgs_msg_dds__Marker_& sample, const Marker& marker, Points& points) {
  sample.ns = borrowed(marker.name);
  sample.id = marker.id;
  sample.type = static_cast<std::int32_t>(marker.kind);
  sample.action = kAdd;
  const auto& [position, turn] = marker.T_frame_marker;
  sample.pose = {{position.x, position.y, position.z}, {turn.x, turn.y, turn.z, turn.w}};
  sample.scale = {marker.scale_m.x, marker.scale_m.y, marker.scale_m.z};
  const auto& [red, green, blue, opacity] = marker.colour;
  sample.color = {red, green, blue, opacity};
  points.clear();
  for (const rt::Vec3& p : marker.points_m) points.push_back({p.x, p.y, p.z});
  lend(sample.points, points.data(), points.size());
  sample.text = borrowed(marker.text);
}

}  // namespace

bool SceneTopics::fixtures(std::int64_t time_ns, std::span<const Marker> markers) {
  const std::string nothing;
  std::vector<Points> points(markers.size());
  std::vector samples(markers.size() + 1, emptyMarker(time_ns, world_frame_, nothing));
  // each message is the whole truth, also for whom a message before it was lost
  samples.front().action = kDeleteAll;
  for (std::size_t i = 0; i < markers.size(); ++i) fill(samples[i + 1], markers[i], points[i]);
  visualization_msgs_msg_dds__MarkerArray_ sample{};
  lend(sample.markers, samples.data(), samples.size());
  return fixtures_.write(&sample);
}

}  // namespace hapticd::tools::ros
