// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "tools/hapticd-ros/dds/participant.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/lib/ros/contents.h"

namespace hapticd::tools::ros {

/// What is published, in the order of the table in publications.cpp.
enum class Topic : std::uint8_t {
  measured_cp,
  measured_cv,
  setpoint_cf,
  operating_state,
  buttons,
  diagnostics,
  tf_static,
};
inline constexpr std::size_t kTopicCount = 7;

/// The topics of one box. Times are UTC in nanoseconds since 1970, positions metres, forces newtons.
/// A message that cannot be written is counted; the first reason is kept.
/// Thread: one at a time.  RT: not safe, as Publisher.
class Publications {
 public:
  /// name_space: of the topics, "hapticd" or "left/hapticd". `frame`: id of the frame of all poses,
  /// velocities and forces.
  static base::Result<Publications> open(const Participant& participant, const std::string& name_space,
                                         std::string frame);

  void measuredPose(std::int64_t time_ns, const rt::RigidPose& T_world_tool);
  /// The angular velocity is sent as zero.
  void measuredVelocity(std::int64_t time_ns, const rt::Vec3& linear_m_per_s_in_world);
  /// The torque is sent as zero.
  void setpointForce(std::int64_t time_ns, const rt::Vec3& force_n_in_world);
  void operatingState(std::int64_t time_ns, std::string_view state, bool is_homed, bool is_busy);
  void buttons(std::int64_t time_ns, std::span<float> axes, std::span<std::int32_t> buttons);
  void diagnostics(std::int64_t time_ns, std::span<const Diagnostic> parts);
  void fixedFrames(std::int64_t time_ns, std::span<const FixedFrame> frames);

  /// The number of messages, those that could not be written without.
  std::uint64_t written() const noexcept;
  std::uint64_t failed() const noexcept;
  /// Why the first message since the last call could not be written; nothing: all could.
  std::optional<base::Error> takeProblem() { return std::exchange(problem_, std::nullopt); }
  /// In the order of Topic.
  const std::vector<Publisher>& publishers() const noexcept { return publishers_; }

 private:
  explicit Publications(std::string frame) : frame_(std::move(frame)) {}

  void write(Topic topic, const void* sample);

  std::vector<Publisher> publishers_;
  std::string frame_;
  std::optional<base::Error> problem_;
};

}  // namespace hapticd::tools::ros
