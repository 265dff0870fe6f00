// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/handle/simulated/simulated_hand.h"
#include "rt/base/rigid_pose.h"
#include "tests/ros/ros_listener.h"

namespace hapticd::test {

/// What can be wrong with a simulated arm; bits, set by a test at any time.
enum CrtkFault : std::uint32_t {
  kCrtkSilent = 1,      ///< measures, and publishes nothing
  kCrtkNotFinite = 2,   ///< the position is NaN
  kCrtkNotUnit = 4,     ///< the quaternion has the length 2
  kCrtkZeroStamp = 8,   ///< as CRTK marks invalid data
  kCrtkJump = 16,       ///< positions are 0.3 m off
  kCrtkOtherFrame = 32  ///< frame_id is another one
};

struct CrtkArmSettings {
  std::int64_t period_ns = 2'000'000;   ///< of its loop and of what it publishes
  std::int64_t measuring_delay_ns = 0;  ///< from a measurement until it is published
  std::int64_t driving_delay_ns = 0;    ///< from the sending of a wrench until the loop may take it
  std::int64_t clock_ahead_ns = 0;      ///< of its stamps
  std::int64_t watchdog_ns = 0;         ///< a wrench that is older is dropped; 0: it is kept, as CRTK has it
  bool has_absolute = true;             ///< takes body/set_cf_orientation_absolute
  bool knows_only_base = false;         ///< as if that were set, as the JHU components of the Touch have it
  bool keeps_state = true;              ///< operating_state is kept for those who come later
  rt::RigidPose T_base_local = {};      ///< from local/measured_cp to measured_cp
  rt::Quaternion turned = {};           ///< of the tool in the hand
  bool hand_waits = false;              ///< for begin()
  drivers::SimulatedHandleSettings hand;  ///< in the frame of local/measured_cp
};

/// What the arm has seen and done. Times: CLOCK_MONOTONIC. Forces: in the frame of local/measured_cp.
struct CrtkArmRecord {
  rt::Vec3 exerted_n;
  rt::Vec3 tip_torque_n_m;
  double most_exerted_n = 0;
  double most_torque_n_m = 0;
  std::int64_t last_exerted_ns = 0;
  std::int64_t last_wrench_ns = 0;  ///< when one was taken last
  std::uint64_t wrenches = 0;
  std::uint64_t zeros = 0;           ///< of these without a force
  std::uint64_t zeros_in_a_row = 0;  ///< of those taken last
  bool absolute = false;
  bool gravity_compensation = false;
  rt::Vec3 position_m;            ///< in the frame of measured_cp
  double energy_j = 0;            ///< given to the hand, or taken from it
  double most_given_j = 0;        ///< the largest energy that it had given at any time
  std::uint64_t late_forces = 0;  ///< that were commanded over 50 ms after it was disabled or no longer homed
};

/// An arm that speaks CRTK as a dVRK MTM does, in a person's hand and in real time, on a thread of the test,
/// so that it outlives a program that is killed. It uses DDS directly and shares no code with the bridge.
class SimulatedCrtkArm {
 public:
  static constexpr std::int64_t kStep_ns = 250'000;
  static constexpr const char* kFrame = "base";

  SimulatedCrtkArm(int domain, std::string name, const CrtkArmSettings& settings = {});
  ~SimulatedCrtkArm();
  SimulatedCrtkArm(const SimulatedCrtkArm&) = delete;
  SimulatedCrtkArm& operator=(const SimulatedCrtkArm&) = delete;

  const std::string& name() const { return name_; }
  CrtkArmRecord record() const;
  void setFaults(std::uint32_t faults) { faults_ = faults; }
  void setState(const std::string& state, bool is_homed);
  /// The hand that waits begins.
  void begin() { begun_ = true; }
  /// The gripper opens that far.
  void setGripper(double opening_rad) { gripper_rad_ = opening_rad; }

 private:
  struct Timed {
    std::int64_t due_ns = 0;
    std::int64_t stamp_utc_ns = 0;
    rt::RigidPose T_local_tip;
    rt::Vec3 velocity_m_per_s;
  };
  struct Taken {
    std::int64_t due_ns = 0;
    rt::Vec3 force_n;
    rt::Vec3 torque_n_m;
    bool spatial = false;
  };

  dds_entity_t writer(const std::string& topic, const dds_topic_descriptor_t& type, bool kept = false);
  dds_entity_t reader(const std::string& topic, const dds_topic_descriptor_t& type);
  void run();
  void cycle(std::int64_t now_ns);
  void hear();
  void hearWrenches(dds_entity_t reader, bool spatial);
  void drive(std::int64_t now_ns);
  void measure(std::int64_t now_ns);
  void publishDue(std::int64_t now_ns);
  void publishPose(const Timed& timed);
  void publishState();
  rt::RigidPose tip() const;

  std::string name_;
  CrtkArmSettings settings_;
  RosListener domain_;  // which makes the domain at loopback
  dds_entity_t participant_;
  dds_entity_t poses_;
  dds_entity_t local_poses_;
  dds_entity_t velocities_;
  dds_entity_t states_;
  dds_entity_t grippers_;
  dds_entity_t body_wrenches_;
  dds_entity_t spatial_wrenches_;
  dds_entity_t absolute_ = 0;
  dds_entity_t gravity_;
  drivers::SimulatedHand hand_;
  std::deque<Timed> measured_;
  std::deque<Taken> wrenches_;
  Taken wrench_;
  std::int64_t moved_to_ns_ = 0;
  mutable std::mutex mutex_;
  CrtkArmRecord record_;
  std::string state_ = "ENABLED";
  bool is_homed_ = true;
  std::int64_t state_ns_ = 0;  // when it changed last
  std::atomic<double> gripper_rad_{0.3};
  std::atomic<std::uint32_t> faults_{0};
  std::atomic<bool> begun_{false};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace hapticd::test
