// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/publications.h"

#include <fmt/format.h>

#include <cstddef>
#include <vector>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "tools/lib/ros/message_definitions.h"
#include "tools/lib/ros/type_hash.h"

namespace hapticd::tools::ros {
namespace {

/// How long what was written is kept for readers.
enum class Kept : std::uint8_t {
  newest_ten,     ///< for readers that were there
  last_for_late,  ///< the last one also for readers that come later
};

struct TopicRow {
  Topic topic;
  std::string_view name;
  bool in_namespace;  ///< false: ROS 2 has one topic of that name for all
  std::string_view message;
  const dds_topic_descriptor_t& type;
  Kept kept;
};
const std::array<TopicRow, kTopicCount> kTopics{{
    {Topic::measured_cp, "measured_cp", true, "geometry_msgs/PoseStamped",
     geometry_msgs_msg_dds__PoseStamped__desc, Kept::newest_ten},
    {Topic::measured_cv, "measured_cv", true, "geometry_msgs/TwistStamped",
     geometry_msgs_msg_dds__TwistStamped__desc, Kept::newest_ten},
    {Topic::setpoint_cf, "setpoint_cf", true, "geometry_msgs/WrenchStamped",
     geometry_msgs_msg_dds__WrenchStamped__desc, Kept::newest_ten},
    {Topic::operating_state, "operating_state", true, "crtk_msgs/OperatingState",
     crtk_msgs_msg_dds__OperatingState__desc, Kept::last_for_late},
    {Topic::buttons, "buttons", true, "sensor_msgs/Joy", sensor_msgs_msg_dds__Joy__desc, Kept::newest_ten},
    {Topic::diagnostics, "diagnostics", false, "diagnostic_msgs/DiagnosticArray",
     diagnostic_msgs_msg_dds__DiagnosticArray__desc, Kept::newest_ten},
    {Topic::tf_static, "tf_static", false, "tf2_msgs/TFMessage", tf2_msgs_msg_dds__TFMessage__desc,
     Kept::last_for_late},
}};

dds_qos_t* newQosFor(const TopicRow& row) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(Publications::kMaxBlocking_ms));
  const bool for_late = row.kept == Kept::last_for_late;
  dds_qset_durability(qos, for_late ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, for_late ? 1 : 10);
  dds_qset_writer_data_lifecycle(qos, /*autodispose=*/false);
  const dds_data_representation_id_t plain_cdr = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &plain_cdr);
  return qos;
}

/// Cyclone DDS takes the texts and lists of samples as if it were to change them, and does not.
char* borrowed(const std::string& text) {
  return const_cast<char*>(text.c_str());
}

builtin_interfaces_msg_dds__Time_ rosTime(std::int64_t time_ns) {
  return {static_cast<std::int32_t>(time_ns / rt::kNsPerSecond),
          static_cast<std::uint32_t>(time_ns % rt::kNsPerSecond)};
}
std_msgs_msg_dds__Header_ header(std::int64_t time_ns, const std::string& frame) {
  return {rosTime(time_ns), borrowed(frame)};
}
geometry_msgs_msg_dds__Vector3_ rosVector(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}
geometry_msgs_msg_dds__Quaternion_ rosQuaternion(const rt::Quaternion& q) {
  return {q.x, q.y, q.z, q.w};
}

}  // namespace

base::Result<Publications> Publications::open(Participant participant, const std::string& name_space,
                                              std::string frame) {
  Publications all(std::move(participant), std::move(frame));
  if (auto added = all.addWriters(name_space); !added) return std::unexpected(added.error());
  return all;
}

base::Result<void> Publications::addWriters(const std::string& name_space) {
  for (const TopicRow& row : kTopics) {
    const std::string name =
        row.in_namespace ? fmt::format("rt/{}/{}", name_space, row.name) : fmt::format("rt/{}", row.name);
    dds_qos_t* const qos = newQosFor(row);
    const dds_entity_t topic = dds_create_topic(participant_.get(), &row.type, name.c_str(), qos, nullptr);
    const std::string user_data = fmt::format("typehash={};", typeHash(row.message));
    dds_qset_userdata(qos, user_data.data(), user_data.size());
    const dds_entity_t writer =
        topic < 0 ? topic : dds_create_writer(participant_.get(), topic, qos, nullptr);
    dds_delete_qos(qos);
    if (writer < 0)
      return std::unexpected(base::Error{"topic " + name,
                                         std::string("cannot be made: ") + dds_strretcode(-writer),
                                         "a --namespace of fewer characters may do"});
    writers_[static_cast<std::size_t>(row.topic)] = writer;
  }
  return {};
}

void Publications::write(Topic topic, const void* sample) {
  const auto place = static_cast<std::size_t>(topic);
  const dds_return_t result = dds_write(writers_[place], sample);
  if (result == DDS_RETCODE_OK) {
    ++written_;
    return;
  }
  ++failed_;
  if (problem_) return;
  problem_ = base::Error{fmt::format("topic {}", kTopics[place].name),
                         fmt::format("a message could not be written: {}", dds_strretcode(-result)),
                         result == DDS_RETCODE_TIMEOUT ? "a subscriber does not keep up: a lower --rate helps"
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
  sample.axes._length = sample.axes._maximum = static_cast<std::uint32_t>(axes.size());
  sample.axes._buffer = axes.data();
  sample.buttons._length = sample.buttons._maximum = static_cast<std::uint32_t>(buttons.size());
  sample.buttons._buffer = buttons.data();
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
    one.values._length = one.values._maximum = static_cast<std::uint32_t>(pairs.size());
    one.values._buffer = pairs.data();
  }
  const std::string no_frame;
  diagnostic_msgs_msg_dds__DiagnosticArray_ sample{header(time_ns, no_frame), {}};
  sample.status._length = sample.status._maximum = static_cast<std::uint32_t>(status.size());
  sample.status._buffer = status.data();
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
  sample.transforms._length = sample.transforms._maximum = static_cast<std::uint32_t>(transforms.size());
  sample.transforms._buffer = transforms.data();
  write(Topic::tf_static, &sample);
}

}  // namespace hapticd::tools::ros
