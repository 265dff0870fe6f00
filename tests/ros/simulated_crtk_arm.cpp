// SPDX-License-Identifier: Apache-2.0
#include "tests/ros/simulated_crtk_arm.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "ros_messages.h"
#include "rt/base/clock.h"

namespace hapticd::test {
namespace {

builtin_interfaces_msg_dds__Time_ timeOf(std::int64_t utc_ns) {
  return {static_cast<std::int32_t>(utc_ns / rt::kNsPerSecond),
          static_cast<std::uint32_t>(utc_ns % rt::kNsPerSecond)};
}

/// Calls take(message, sent_utc_ns) for all that have come.
template <typename Message>
void takeAll(dds_entity_t reader, auto take) {
  std::array<void*, 64> samples{};
  std::array<dds_sample_info_t, 64> infos{};
  const dds_return_t count = dds_take(reader, samples.data(), infos.data(), samples.size(), samples.size());
  for (std::size_t i = 0; count > 0 && i < static_cast<std::size_t>(count); ++i) {
    if (infos[i].valid_data) take(*static_cast<const Message*>(samples[i]), infos[i].source_timestamp);
  }
  if (count > 0) dds_return_loan(reader, samples.data(), count);
}

}  // namespace

SimulatedCrtkArm::SimulatedCrtkArm(int domain, std::string name, const CrtkArmSettings& settings)
    : name_(std::move(name)),
      settings_(settings),
      domain_(domain),
      participant_(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr)),
      poses_(writer("measured_cp", geometry_msgs_msg_dds__PoseStamped__desc)),
      local_poses_(writer("local/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc)),
      velocities_(writer("measured_cv", geometry_msgs_msg_dds__TwistStamped__desc)),
      states_(writer("operating_state", crtk_msgs_msg_dds__OperatingState__desc, settings.keeps_state)),
      grippers_(writer("gripper/measured_js", sensor_msgs_msg_dds__JointState__desc)),
      body_wrenches_(reader("body/servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc)),
      spatial_wrenches_(reader("spatial/servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc)),
      gravity_(reader("use_gravity_compensation", std_msgs_msg_dds__Bool__desc)),
      hand_(settings.hand, static_cast<double>(kStep_ns) * 1e-9) {
  if (settings_.has_absolute)
    absolute_ = reader("body/set_cf_orientation_absolute", std_msgs_msg_dds__Bool__desc);
  EXPECT_GT(participant_, 0);
  publishState();
  thread_ = std::thread([this] { run(); });
}

SimulatedCrtkArm::~SimulatedCrtkArm() {
  ends_ = true;
  thread_.join();
  dds_delete(participant_);
}

dds_entity_t SimulatedCrtkArm::writer(const std::string& topic, const dds_topic_descriptor_t& type,
                                      bool kept) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_durability(qos, kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, kept ? 1 : 10);
  const dds_entity_t entity =
      dds_create_topic(participant_, &type, ("rt/" + name_ + "/" + topic).c_str(), nullptr, nullptr);
  const dds_entity_t made = dds_create_writer(participant_, entity, qos, nullptr);
  dds_delete_qos(qos);
  EXPECT_GT(made, 0) << topic;
  return made;
}

dds_entity_t SimulatedCrtkArm::reader(const std::string& topic, const dds_topic_descriptor_t& type) {
  dds_qos_t* const qos = dds_create_qos();  // as rclcpp has it
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  const dds_entity_t entity =
      dds_create_topic(participant_, &type, ("rt/" + name_ + "/" + topic).c_str(), nullptr, nullptr);
  const dds_entity_t made = dds_create_reader(participant_, entity, qos, nullptr);
  dds_delete_qos(qos);
  EXPECT_GT(made, 0) << topic;
  return made;
}

CrtkArmRecord SimulatedCrtkArm::record() const {
  const std::lock_guard lock(mutex_);
  return record_;
}

void SimulatedCrtkArm::setState(const std::string& state, bool is_homed) {
  const std::lock_guard lock(mutex_);
  state_ = state;
  is_homed_ = is_homed;
  state_ns_ = rt::monotonicNow_ns();
  publishState();
}

void SimulatedCrtkArm::publishState() {
  std::string frame;
  const crtk_msgs_msg_dds__OperatingState_ sample{
      {timeOf(rt::realtimeNow_ns()), frame.data()}, state_.data(), is_homed_, false};
  dds_write(states_, &sample);
}

rt::RigidPose SimulatedCrtkArm::tip() const {
  return {hand_.position_m_in_world(), settings_.turned * hand_.orientation_in_world()};
}

void SimulatedCrtkArm::run() {
  moved_to_ns_ = rt::monotonicNow_ns();
  rt::PeriodicClock clock(settings_.period_ns);
  clock.start(moved_to_ns_);
  while (!ends_) {
    const bool publishes_first = !measured_.empty() && measured_.front().due_ns < clock.planned_ns();
    rt::sleepUntil(publishes_first ? measured_.front().due_ns : clock.planned_ns());
    const std::int64_t now_ns = rt::monotonicNow_ns();
    if (now_ns >= clock.planned_ns()) {
      cycle(now_ns);
      clock.advance(rt::monotonicNow_ns());
    }
    publishDue(rt::monotonicNow_ns());
  }
}

void SimulatedCrtkArm::cycle(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  // the motion up to now is that under the wrench of before
  const std::int64_t kMostBehind_ns = 50'000'000;
  moved_to_ns_ = std::max(moved_to_ns_, now_ns - kMostBehind_ns);
  for (; now_ns - moved_to_ns_ >= kStep_ns; moved_to_ns_ += kStep_ns) {
    if (settings_.hand_waits && !begun_) continue;
    hand_.step(record_.exerted_n);
    record_.energy_j +=
        dot(record_.exerted_n, hand_.velocity_m_per_s_in_world()) * static_cast<double>(kStep_ns) * 1e-9;
    record_.most_given_j = std::max(record_.most_given_j, record_.energy_j);
  }
  hear();
  drive(now_ns);
  measure(now_ns);
}

void SimulatedCrtkArm::hear() {
  hearWrenches(body_wrenches_, false);
  hearWrenches(spatial_wrenches_, true);
  if (absolute_ > 0)
    takeAll<std_msgs_msg_dds__Bool_>(
        absolute_, [this](const auto& message, std::int64_t) { record_.absolute = message.data; });
  takeAll<std_msgs_msg_dds__Bool_>(
      gravity_, [this](const auto& message, std::int64_t) { record_.gravity_compensation = message.data; });
}

void SimulatedCrtkArm::hearWrenches(dds_entity_t reader, bool spatial) {
  const std::int64_t monotonic_ahead_ns = rt::monotonicNow_ns() - rt::realtimeNow_ns();
  takeAll<geometry_msgs_msg_dds__WrenchStamped_>(reader, [&](const auto& message, std::int64_t sent_utc_ns) {
    const auto& f = message.wrench.force;
    const auto& t = message.wrench.torque;
    const std::int64_t sent_ns = sent_utc_ns + monotonic_ahead_ns;
    const rt::Vec3 force_n{f.x, f.y, f.z};
    wrenches_.push_back({sent_ns + settings_.driving_delay_ns, force_n, {t.x, t.y, t.z}, spatial});
    const bool is_on = state_ == "ENABLED" && is_homed_;
    if (!is_on && norm(force_n) > 0 && sent_ns - state_ns_ > 50'000'000) ++record_.late_forces;
    ++record_.wrenches;
    if (norm(force_n) == 0) ++record_.zeros;
    record_.last_wrench_ns = rt::monotonicNow_ns();
    record_.zeros_in_a_row = norm(force_n) > 0 ? 0 : record_.zeros_in_a_row + 1;
  });
}

/// What a dVRK does with a wrench: that of the body acts at the tip along its axes, or along those of
/// measured_cp where that is set; the spatial one acts at the origin of local/measured_cp.
void SimulatedCrtkArm::drive(std::int64_t now_ns) {
  for (; !wrenches_.empty() && wrenches_.front().due_ns <= now_ns; wrenches_.pop_front())
    wrench_ = wrenches_.front();
  const bool is_on = state_ == "ENABLED" && is_homed_;
  const bool dropped = settings_.watchdog_ns > 0 && now_ns - record_.last_wrench_ns > settings_.watchdog_ns;
  const rt::RigidPose at = tip();
  const rt::Quaternion from_base = inverse(settings_.T_base_local.orientation);
  const rt::Quaternion axes = record_.absolute || settings_.knows_only_base ? from_base : at.orientation;
  rt::Vec3 force_n = wrench_.spatial ? wrench_.force_n : rotated(axes, wrench_.force_n);
  rt::Vec3 torque_n_m = wrench_.spatial ? wrench_.torque_n_m - cross(at.position_m_in_world, force_n)
                                        : rotated(axes, wrench_.torque_n_m);
  if (!is_on || dropped) force_n = torque_n_m = {};
  record_.exerted_n = force_n;
  record_.tip_torque_n_m = torque_n_m;
  record_.most_exerted_n = std::max(record_.most_exerted_n, norm(force_n));
  record_.most_torque_n_m = std::max(record_.most_torque_n_m, norm(torque_n_m));
  if (norm(force_n) > 0) record_.last_exerted_ns = now_ns;
}

void SimulatedCrtkArm::measure(std::int64_t now_ns) {
  const rt::RigidPose at = tip();
  const rt::RigidPose& base = settings_.T_base_local;
  record_.position_m = base.position_m_in_world + rotated(base.orientation, at.position_m_in_world);
  measured_.push_back({now_ns + settings_.measuring_delay_ns, rt::realtimeNow_ns() + settings_.clock_ahead_ns,
                       at, hand_.velocity_m_per_s_in_world()});
}

void SimulatedCrtkArm::publishDue(std::int64_t now_ns) {
  for (; !measured_.empty() && measured_.front().due_ns <= now_ns; measured_.pop_front()) {
    if ((faults_ & kCrtkSilent) == 0) publishPose(measured_.front());
  }
}

void SimulatedCrtkArm::publishPose(const Timed& timed) {
  const std::uint32_t faults = faults_;
  std::string frame = (faults & kCrtkOtherFrame) != 0 ? "elsewhere" : kFrame;
  const std_msgs_msg_dds__Header_ header{
      (faults & kCrtkZeroStamp) != 0 ? builtin_interfaces_msg_dds__Time_{} : timeOf(timed.stamp_utc_ns),
      frame.data()};
  const auto message = [&](const rt::RigidPose& pose) {
    rt::Vec3 p = pose.position_m_in_world;
    if ((faults & kCrtkJump) != 0) p.x += 0.3;
    if ((faults & kCrtkNotFinite) != 0) p.y = std::numeric_limits<double>::quiet_NaN();
    const double scale = (faults & kCrtkNotUnit) != 0 ? 2 : 1;
    const rt::Quaternion& q = pose.orientation;
    return geometry_msgs_msg_dds__PoseStamped_{
        header, {{p.x, p.y, p.z}, {scale * q.x, scale * q.y, scale * q.z, scale * q.w}}};
  };
  const rt::RigidPose& base = settings_.T_base_local;
  const rt::RigidPose& local = timed.T_local_tip;
  const auto in_base =
      message({base.position_m_in_world + rotated(base.orientation, local.position_m_in_world),
               base.orientation * local.orientation});
  const auto in_local = message(local);
  dds_write(poses_, &in_base);
  dds_write(local_poses_, &in_local);
  const rt::Vec3 v = rotated(base.orientation, timed.velocity_m_per_s);
  const geometry_msgs_msg_dds__TwistStamped_ twist{header, {{v.x, v.y, v.z}, {}}};
  dds_write(velocities_, &twist);
  double opening_rad = gripper_rad_;
  std::string joint = "gripper";
  char* names = joint.data();
  const sensor_msgs_msg_dds__JointState_ gripper{
      header, {1, 1, &names, false}, {1, 1, &opening_rad, false}, {}, {}};
  dds_write(grippers_, &gripper);
}

}  // namespace hapticd::test
