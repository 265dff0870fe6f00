// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/publications.h"

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <vector>

#include "ros_messages.h"
#include "tools/hapticd-ros/dds/sample_parts.h"

namespace hapticd::tools::ros {
namespace {

using Late = Publisher::Late;

struct TopicRow {
  Topic topic;
  std::string_view name;
  bool in_namespace;  ///< false: ROS 2 has one topic of that name for all
  std::string_view message;
  const dds_topic_descriptor_t& type;
  Late late;
};
const std::array<TopicRow, kTopicCount> kTopics{{
    {Topic::measured_cp, "measured_cp", true, "geometry_msgs/PoseStamped",
     geometry_msgs_msg_dds__PoseStamped__desc, Late::gets_nothing},
    {Topic::measured_cv, "measured_cv", true, "geometry_msgs/TwistStamped",
     geometry_msgs_msg_dds__TwistStamped__desc, Late::gets_nothing},
    {Topic::setpoint_cf, "setpoint_cf", true, "geometry_msgs/WrenchStamped",
     geometry_msgs_msg_dds__WrenchStamped__desc, Late::gets_nothing},
    {Topic::operating_state, "operating_state", true, "crtk_msgs/OperatingState",
     crtk_msgs_msg_dds__OperatingState__desc, Late::gets_last},
    {Topic::buttons, "buttons", true, "sensor_msgs/Joy", sensor_msgs_msg_dds__Joy__desc, Late::gets_nothing},
    {Topic::diagnostics, "diagnostics", false, "diagnostic_msgs/DiagnosticArray",
     diagnostic_msgs_msg_dds__DiagnosticArray__desc, Late::gets_nothing},
    {Topic::tf_static, "tf_static", false, "tf2_msgs/TFMessage", tf2_msgs_msg_dds__TFMessage__desc,
     Late::gets_last},
}};

/// Of messages for readers that are there, as ROS 2 has it by default.
constexpr int kDepth = 10;

geometry_msgs_msg_dds__Vector3_ rosVector(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}
geometry_msgs_msg_dds__Quaternion_ rosQuaternion(const rt::Quaternion& q) {
  return {q.x, q.y, q.z, q.w};
}

}  // namespace

base::Result<Publications> Publications::open(const Participant& participant, const std::string& name_space,
                                              std::string frame) {
  Publications all(std::move(frame));
  for (const TopicRow& row : kTopics) {
    const std::string name =
        row.in_namespace ? fmt::format("{}/{}", name_space, row.name) : std::string(row.name);
    auto publisher = Publisher::open(participant, name, row.message, row.type, row.late,
                                     row.late == Late::gets_last ? 1 : kDepth);
    if (!publisher) return std::unexpected(publisher.error());
    all.publishers_.push_back(std::move(*publisher));
  }
  return all;
}

std::uint64_t Publications::written() const noexcept {
  std::uint64_t sum = 0;
  for (const Publisher& publisher : publishers_) sum += publisher.written();
  return sum;
}

std::uint64_t Publications::failed() const noexcept {
  std::uint64_t sum = 0;
  for (const Publisher& publisher : publishers_) sum += publisher.failed();
  return sum;
}

void Publications::write(Topic topic, const void* sample) {
  Publisher& publisher = publishers_[static_cast<std::size_t>(topic)];
  if (publisher.write(sample) || problem_) return;
  problem_ = base::Error{
      fmt::format("topic {}", publisher.topic()),
      fmt::format("a message could not be written: {}", dds_strretcode(-publisher.result())),
      publisher.result() == DDS_RETCODE_TIMEOUT ? "a subscriber does not keep up: a lower --rate helps"
                                                : "further ones are counted in the diagnostics"};
}

void Publications::measuredPose(std::int64_t time_ns, const rt::RigidPose& T_world_tool) {
  const rt::Vec3& p = T_world_tool.position_m_in_world;
  const geometry_msgs_msg_dds__PoseStamped_ sample{
      header(time_ns, frame_), {{p.x, p.y, p.z}, rosQuaternion(T_world_tool.orientation)}};
  write(Topic::measured_cp, &sample);
}

void Publications::measuredVelocity(std::int64_t time_ns, const rt::Vec3& linear_m_per_s_in_world) {
  const geometry_msgs_msg_dds__TwistStamped_ sample{header(time_ns, frame_),
                                                    {rosVector(linear_m_per_s_in_world), {}}};
  write(Topic::measured_cv, &sample);
}

void Publications::setpointForce(std::int64_t time_ns, const rt::Vec3& force_n_in_world) {
  const geometry_msgs_msg_dds__WrenchStamped_ sample{header(time_ns, frame_),
                                                     {rosVector(force_n_in_world), {}}};
  write(Topic::setpoint_cf, &sample);
}

void Publications::operatingState(std::int64_t time_ns, std::string_view state, bool is_homed, bool is_busy) {
  const std::string text(state);
  const crtk_msgs_msg_dds__OperatingState_ sample{header(time_ns, frame_), borrowed(text), is_homed, is_busy};
  write(Topic::operating_state, &sample);
}

void Publications::buttons(std::int64_t time_ns, std::span<float> axes, std::span<std::int32_t> buttons) {
  sensor_msgs_msg_dds__Joy_ sample{header(time_ns, frame_), {}, {}};
  lend(sample.axes, axes.data(), axes.size());
  lend(sample.buttons, buttons.data(), buttons.size());
  write(Topic::buttons, &sample);
}

void Publications::diagnostics(std::int64_t time_ns, std::span<const Diagnostic> parts) {
  std::vector<std::vector<diagnostic_msgs_msg_dds__KeyValue_>> values;
  std::vector<diagnostic_msgs_msg_dds__DiagnosticStatus_> status;
  for (const Diagnostic& part : parts) {
    auto& pairs = values.emplace_back();
    for (const auto& [key, value] : part.values) pairs.push_back({borrowed(key), borrowed(value)});
    auto& one = status.emplace_back();
    one.level = static_cast<std::uint8_t>(part.level);
    one.name = borrowed(part.name);
    one.message = borrowed(part.message);
    one.hardware_id = borrowed(part.hardware_id);
    lend(one.values, pairs.data(), pairs.size());
  }
  const std::string no_frame;
  diagnostic_msgs_msg_dds__DiagnosticArray_ sample{header(time_ns, no_frame), {}};
  lend(sample.status, status.data(), status.size());
  write(Topic::diagnostics, &sample);
}

void Publications::fixedFrames(std::int64_t time_ns, std::span<const FixedFrame> frames) {
  std::vector<geometry_msgs_msg_dds__TransformStamped_> transforms;
  for (const FixedFrame& frame : frames) {
    transforms.push_back({header(time_ns, frame.parent),
                          borrowed(frame.name),
                          {rosVector(frame.T_parent_frame.position_m_in_world),
                           rosQuaternion(frame.T_parent_frame.orientation)}});
  }
  tf2_msgs_msg_dds__TFMessage_ sample{};
  lend(sample.transforms, transforms.data(), transforms.size());
  write(Topic::tf_static, &sample);
}

}  // namespace hapticd::tools::ros
