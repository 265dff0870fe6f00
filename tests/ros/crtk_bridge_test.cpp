// SPDX-License-Identifier: Apache-2.0
// haptic-crtk-bridge between a simulated arm that speaks CRTK over DDS and a peer that commands forces in the
// place of hapticd.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <optional>

#include "rt/base/clock.h"
#include "tests/ros/ros_listener.h"
#include "tests/ros/simulated_crtk_arm.h"
#include "tests/support/program.h"
#include "tests/vendor_devices/peer.h"

namespace hapticd::test {
namespace {

const rt::Vec3 kForce_n{0.5, -1, 1.5};

/// A hand that holds the tool at one place, which is not on an axis; turned, and with a base frame.
CrtkArmSettings turnedArm() {
  CrtkArmSettings settings;
  settings.hand.start_m_in_world = {0.3, -0.2, 0.15};
  settings.hand.direction_in_world = {1, 0.5, 0.2};
  settings.hand.speed_m_per_s = 1e-6;
  settings.T_base_local = {{0.05, 0.5, -0.1}, rt::normalised({0.1, 0.6, -0.2, 0.7})};
  settings.turned = rt::normalised({0.3, -0.5, 0.1, 0.8});
  return settings;
}

class CrtkBridge : public ::testing::Test {
 protected:
  void makeArm(const CrtkArmSettings& settings = turnedArm()) {
    settings_ = settings;
    arm_.emplace(ownDomain(), ownNamespace(), settings);
  }
  void start(const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{HAPTIC_CRTK_BRIDGE_PROGRAM,
                                     "--arm",
                                     ownNamespace(),
                                     "--domain",
                                     std::to_string(ownDomain()),
                                     "--peer",
                                     peer_.address(),
                                     "--max-force",
                                     "100"};
    command.insert(command.end(), more.begin(), more.end());
    program_.emplace(command);
  }
  /// Starts, commands the force, and waits until the arm exerts it.
  void startPushing(const std::vector<std::string>& more = {}) {
    peer_.command({.force_n = kForce_n});
    start(more);
    ASSERT_TRUE(exerts(true)) << program_->errors();
  }
  bool exerts(bool something) {
    return becomesTrue([&] { return (norm(arm_->record().exerted_n) > 0) == something; });
  }
  bool says(const std::string& text) {
    const bool said = becomesTrue([&] { return program_->errors().find(text) != std::string::npos; });
    if (!said) ADD_FAILURE() << "not said: " << text << "\n" << program_->errors();
    return said;
  }
  /// Waits until the arm exerts nothing; how long after `since_ns` that was, in ms.
  double zeroAfter_ms(std::int64_t since_ns) {
    EXPECT_TRUE(exerts(false)) << program_->errors();
    return static_cast<double>(arm_->record().last_exerted_ns - since_ns) * 1e-6;
  }
  bool handleIs(bool calibrated, bool fault) {
    return becomesTrue([&] {
      const drivers::udp::StatePacket state = peer_.state();
      return state.header.sequence > 0 && state.calibrated == calibrated && state.fault == fault;
    });
  }

  CrtkArmSettings settings_;
  Peer peer_;
  std::optional<SimulatedCrtkArm> arm_;
  std::optional<Program> program_;
};

void expectNear(const rt::Vec3& a, const rt::Vec3& b, double tolerance) {
  EXPECT_LE(norm(a - b), tolerance) << fmt::format("{} {} {}, not {} {} {}", a.x, a.y, a.z, b.x, b.y, b.z);
}

/// How the arm takes wrenches, and whether the handle's frame is that of measured_cp or of local/measured_cp.
struct WrenchCase {
  std::string convention;
  bool in_local = false;
};
void PrintTo(const WrenchCase& one, std::ostream* stream) {
  *stream << one.convention;
}
class CrtkWrench : public CrtkBridge, public ::testing::WithParamInterface<WrenchCase> {};

TEST_P(CrtkWrench, ActsAtTheTipAlongTheAxesOfTheMeasurementsAndWithoutTorque) {
  makeArm();
  startPushing({"--wrench", GetParam().convention});
  // the hand gives way: what it does until the force has settled is not looked at
  const rt::Quaternion& base = settings_.T_base_local.orientation;
  const rt::Vec3 expected_n = GetParam().in_local ? kForce_n : rotated(inverse(base), kForce_n);
  // the orientation turns with the hand's motion within a period of the arm: 1e-3 of 1.9 N
  EXPECT_TRUE(becomesTrue([&] { return norm(arm_->record().exerted_n - expected_n) < 2e-3; }));
  const CrtkArmRecord record = arm_->record();
  expectNear(record.exerted_n, expected_n, 2e-3);
  EXPECT_NEAR(record.most_exerted_n, norm(kForce_n), 1e-9) << "no stronger force in any direction before";
  EXPECT_LT(norm(record.tip_torque_n_m), 2e-3);
  EXPECT_EQ(record.absolute, GetParam().convention == "body-absolute");
  EXPECT_FALSE(record.gravity_compensation);
}

TEST_P(CrtkWrench, ComesWithThePositionInMetresAndTheOrientationOfTheTool) {
  makeArm();
  start({"--wrench", GetParam().convention});
  ASSERT_TRUE(handleIs(true, false)) << program_->errors();
  const drivers::udp::StatePacket state = peer_.state();
  const rt::Vec3 start_m = settings_.hand.start_m_in_world;
  const rt::RigidPose& base = settings_.T_base_local;
  const rt::Vec3 expected_m =
      GetParam().in_local ? start_m : base.position_m_in_world + rotated(base.orientation, start_m);
  expectNear(state.position_m_in_handle, expected_m, 1e-3);  // the hand creeps
  ASSERT_TRUE(state.orientation_in_handle);
  EXPECT_NEAR(dot(*state.orientation_in_handle, *state.orientation_in_handle), 1, 1e-9);
  EXPECT_FALSE(state.velocity_valid) << "hapticd takes it from the positions";
  EXPECT_FALSE(state.drives_torque);
  arm_->setGripper(0.75);
  EXPECT_TRUE(becomesTrue([&] { return peer_.state().gripper_rad == 0.75; }));
}

INSTANTIATE_TEST_SUITE_P(All, CrtkWrench,
                         ::testing::Values(WrenchCase{"body-absolute"}, WrenchCase{"body"},
                                           WrenchCase{"spatial", true}),
                         [](const auto& one) {
                           return one.param.convention == "body-absolute" ? "bodyAbsolute"
                                                                          : one.param.convention;
                         });

}  // namespace
}  // namespace hapticd::test
