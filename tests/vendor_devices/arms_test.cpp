// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <thread>

#include "rt/base/clock.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/bridge_under_test.h"
#include "tests/vendor_devices/peer.h"
#include "tools/haptic-bridge/base/device_rows.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::test {

// haptic-bridge with the fake libraries of two vendors: what holds for every arm.
namespace {

class VendorArm : public ::testing::TestWithParam<VendorKind> {
 protected:
  BridgeUnderTest bridge_{GetParam()};
  ArmMemory& arm_ = bridge_.memory();
};

TEST_P(VendorArm, IsReadInMetresWithItsOrientationAndButtons) {
  arm_.buttons = 0b10;
  bridge_.start();
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return !state.fault && state.calibrated; }))
      << bridge_.program().errors();
  ASSERT_TRUE(bridge_.passStates(10));
  const drivers::udp::StatePacket state = bridge_.peer().state();
  constexpr double kHandDrifts_m = 1e-4;  // at a micrometre a second, and as its spring settles
  EXPECT_NEAR(state.position_m_in_handle.x, 0.03, kHandDrifts_m);
  EXPECT_NEAR(state.position_m_in_handle.y, -0.02, kHandDrifts_m);
  EXPECT_NEAR(state.position_m_in_handle.z, 0.05, kHandDrifts_m);
  EXPECT_EQ(state.buttons, 0b10U);
  EXPECT_FALSE(state.velocity_valid) << "hapticd computes one that it knows the lag of";
  ASSERT_TRUE(state.orientation_in_handle);
  const rt::Quaternion held{arm_.orientation[0], arm_.orientation[1], arm_.orientation[2],
                            arm_.orientation[3]};
  ASSERT_LT(std::abs(held.w), 0.99) << "it is turned, so that a transposed matrix shows";
  EXPECT_NEAR(std::abs(dot(*state.orientation_in_handle, held)), 1, 1e-6);
}

TEST_P(VendorArm, ExertsWhatIsCommandedInNewtons) {
  ASSERT_TRUE(bridge_.startPushing({0.5, -1, 1.5})) << bridge_.program().errors();
  EXPECT_DOUBLE_EQ(arm_.force_n[0], 0.5);
  EXPECT_DOUBLE_EQ(arm_.force_n[1], -1);
  EXPECT_DOUBLE_EQ(arm_.force_n[2], 1.5);
}

TEST_P(VendorArm, NeverExertsMoreThanItsModelBears) {
  ASSERT_TRUE(bridge_.startPushing({60, 0, -80}));
  ASSERT_TRUE(bridge_.passStates(100));
  const double limit_n = GetParam().limit_n;
  EXPECT_NEAR(arm_.most_exerted_n, limit_n, 1e-9) << "all of it, and no more";
  EXPECT_NEAR(arm_.force_n[0], 0.6 * limit_n, 1e-9);
  EXPECT_NEAR(arm_.force_n[2], -0.8 * limit_n, 1e-9);
}

TEST_P(VendorArm, IsLeftWithoutForceByAProgramThatIsTerminated) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.program().signal(SIGTERM);
  EXPECT_EQ(bridge_.program().wait(), exitedWith(0)) << bridge_.program().errors();
  EXPECT_FALSE(arm_.force_on);
  for (const auto& force_n : arm_.force_n) EXPECT_EQ(force_n, 0);
  EXPECT_TRUE(arm_.brakes || GetParam().word == "openhaptics") << "which has none";
  EXPECT_TRUE(bridge_.letsGo());
}

TEST_P(VendorArm, IsLeftWithoutForceBeforeItIsCalibratedToo) {
  bridge_.setFaults(kArmNotCalibrated);
  bridge_.start();
  ASSERT_TRUE(bridge_.says("does not know its position"));
  bridge_.program().signal(SIGTERM);
  EXPECT_EQ(bridge_.program().wait(), exitedWith(0));
  EXPECT_FALSE(arm_.force_on);
}

TEST_P(VendorArm, DropsTheForceOfAProgramThatIsKilled) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.program().signal(SIGKILL);
  (void)bridge_.program().wait();
  const std::int64_t gone_ns = rt::monotonicNow_ns();
  ASSERT_TRUE(bridge_.letsGo());
  constexpr std::int64_t kDeadMan_ns = 20'000'000;
  EXPECT_LE(arm_.force_ns, gone_ns);
  EXPECT_LE(arm_.last_exerted_ns - arm_.force_ns, kDeadMan_ns + 4 * EmulatedArm::kStep_ns);
  RecordProperty("us_after_last_force", std::to_string((arm_.last_exerted_ns - arm_.force_ns) / 1000));
}

TEST_P(VendorArm, GetsNoForceWhileTheProgramHasNoCommand) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.peer().command({});
  EXPECT_TRUE(bridge_.letsGo());
}

TEST_P(VendorArm, GetsNoForceBeforeItIsCalibrated) {
  bridge_.setFaults(kArmNotCalibrated);
  bridge_.peer().command({.force_n = {0, 0, 2}});
  bridge_.start();
  ASSERT_TRUE(bridge_.says("does not know its position"));
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return !state.fault && !state.calibrated; }))
      << "hapticd is to show that it calibrates, not that it is lost";
  ASSERT_TRUE(bridge_.passStates(200));
  EXPECT_EQ(arm_.exerted_n, 0);
  arm_.docked = true;
  if (GetParam().word == "force-dimension") bridge_.setFaults(0);  // the person has initialised it
  EXPECT_TRUE(bridge_.pushes()) << bridge_.program().errors();
  EXPECT_EQ(arm_.faults, 0U);
  EXPECT_EQ(arm_.uncalibrated_force_steps, 0U);
  EXPECT_EQ(bridge_.timesSaid("does not know its position"), 1);
}

TEST_P(VendorArm, GetsNoForceAfterItHasLostItsCalibrationInUse) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.setFaults(kArmNotCalibrated);
  ASSERT_TRUE(bridge_.says("does not know its position"));
  ASSERT_TRUE(bridge_.letsGo());
  const std::uint64_t steps = arm_.uncalibrated_force_steps;
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return !state.calibrated; }));
  ASSERT_TRUE(bridge_.passStates(200));
  EXPECT_EQ(arm_.uncalibrated_force_steps, steps);
  arm_.docked = true;
  if (GetParam().word == "force-dimension") bridge_.setFaults(0);
  EXPECT_TRUE(bridge_.pushes()) << "and is used again: " << bridge_.program().errors();
}

TEST_P(VendorArm, IsOpenedAgainAfterItWasUnplugged) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.setFaults(kArmUnplugged);
  ASSERT_TRUE(bridge_.says("lost: ")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return state.fault; }));
  ASSERT_TRUE(bridge_.letsGo());
  ASSERT_TRUE(bridge_.says("cannot be opened: ")) << "why it does not come back";
  EXPECT_EQ(bridge_.timesSaid("cannot be opened: "), 1);
  bridge_.setFaults(0);
  EXPECT_TRUE(bridge_.pushes()) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.stateBecomes([](const auto& state) { return !state.fault; }));
  EXPECT_EQ(arm_.openings, 2U);
}

TEST_P(VendorArm, IsSaidToBeLostEachTime) {
  ASSERT_TRUE(bridge_.startPushing());
  for (int times = 1; times <= 2; ++times) {
    bridge_.setFaults(kArmJump);
    ASSERT_TRUE(becomesTrue([&] { return bridge_.timesSaid("jumped farther") == times; }))
        << bridge_.program().errors();
    bridge_.setFaults(0);
    ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return state.fault; }));
    ASSERT_TRUE(bridge_.pushes());
  }
}

TEST_P(VendorArm, IsOpenedOnceAnotherProgramLeavesIt) {
  bridge_.setFaults(kArmBusy);
  bridge_.peer().command({.force_n = {0, 0, 2}});
  bridge_.start();
  ASSERT_TRUE(bridge_.says("end other programs that use it")) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.stateBecomes([](const auto& state) { return state.fault; }));
  bridge_.setFaults(0);
  EXPECT_TRUE(bridge_.pushes());
}

TEST_P(VendorArm, GetsNoForceWhileItsPositionIsNoNumber) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.setFaults(kArmNotFinite);
  ASSERT_TRUE(bridge_.says("no number"));
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return state.fault; }))
      << "and the packets are sound";
  ASSERT_TRUE(bridge_.letsGo());
  bridge_.setFaults(0);
  EXPECT_TRUE(bridge_.pushes());
}

TEST_P(VendorArm, IsOpenedAgainAfterItsPositionHasJumped) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.setFaults(kArmJump);
  ASSERT_TRUE(bridge_.says("jumped farther than a hand can move it")) << bridge_.program().errors();
  EXPECT_TRUE(becomesTrue([&] { return arm_.openings == 2; }));
  EXPECT_TRUE(bridge_.pushes());
}

TEST_P(VendorArm, GetsNoForceWhileItsCallsTakeTooLong) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.setFaults(kArmSlow);
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return state.fault; }));
  ASSERT_TRUE(bridge_.letsGo());
  if (GetParam().word == "force-dimension") {
    EXPECT_TRUE(bridge_.says("readings a second")) << bridge_.program().errors();
  }
  bridge_.setFaults(0);
  EXPECT_TRUE(bridge_.pushes()) << bridge_.program().errors();
}

TEST_P(VendorArm, NamesTheCallThatHangsWhileItHangs) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.setFaults(kArmHangs);
  const std::string name = GetParam().word == "openhaptics" ? "hdBeginFrame" : "dhd";
  ASSERT_TRUE(bridge_.says(" hangs: the device gets no new force")) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.says(": " + name)) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.letsGo());
  bridge_.setFaults(0);
  EXPECT_TRUE(bridge_.says("has returned after about")) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.pushes()) << bridge_.program().errors();
}

TEST_P(VendorArm, ReportsTheDelayOfItsMeasurements) {
  bridge_.start();
  static constexpr std::int64_t kBuiltIn_ns = 6'000'000;
  const auto latencyBecomes = [&](bool large) {
    return bridge_.stateBecomes([large](const auto& state) {
      return !state.fault && state.calibrated && state.device_latency_ns > 0 &&
             (state.device_latency_ns >= kBuiltIn_ns) == large;
    });
  };
  ASSERT_TRUE(latencyBecomes(false)) << "how late an idle machine is";
  arm_.extra_delay_ns = kBuiltIn_ns;
  ASSERT_TRUE(latencyBecomes(true));
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(bridge_.passStates(5));
    const auto state = bridge_.peer().state();
    EXPECT_TRUE(state.fault || !state.calibrated || state.device_latency_ns >= kBuiltIn_ns)
        << state.device_latency_ns;
  }
  arm_.extra_delay_ns = 0;
  EXPECT_TRUE(latencyBecomes(false)) << "and forgets it";
}

INSTANTIATE_TEST_SUITE_P(All, VendorArm, ::testing::Values(forceDimension(), openHaptics()),
                         [](const auto& kind) { return kind.param.name(); });

// The drivers in this process, in the place of the bridge's loop.

std::unique_ptr<tools::DeviceDriver> driverOf(const VendorKind& kind) {
  for (const tools::DeviceRow& row : tools::deviceRows()) {
    if (row.word == kind.word) return row.make({.library = kind.library, .device = {}, .address = {}});
  }
  return nullptr;
}

class DeviceDriverInProcess : public ::testing::TestWithParam<VendorKind> {
 protected:
  DeviceDriverInProcess() {
    ::setenv(kArmVariable, path_.c_str(), 1);
    arm_.memory().model = GetParam().model;
  }
  ~DeviceDriverInProcess() override { ::unsetenv(kArmVariable); }

  /// Answers the readings with 2 N, once a millisecond, until the arm exerts that.
  bool pushes(tools::Device& device) {
    return becomesTrue(
        [&] {
          (void)device.read();
          device.exert({.force_n = {0, 0, 2}, .torque_n_m = {}});
          return arm_.memory().exerted_n > 0;
        },
        std::chrono::milliseconds(1));
  }

  TemporaryFolder folder_{memoryFolder()};
  std::filesystem::path path_ = folder_.path() / "arm";
  EmulatedArm arm_{path_, stillHand()};
};

TEST_P(DeviceDriverInProcess, LetsGoWhenTheBridgesLoopHangs) {
  tools::ThreadedDevice device(driverOf(GetParam()), "test");
  ASSERT_TRUE(device.start());
  ASSERT_TRUE(pushes(device));
  EXPECT_TRUE(becomesTrue([&] { return arm_.memory().exerted_n == 0; }));
  const std::uint64_t forces = arm_.memory().forces;
  EXPECT_TRUE(becomesTrue([&] { return arm_.memory().forces > forces; }))
      << "the driver itself goes on, at zero";
}

INSTANTIATE_TEST_SUITE_P(All, DeviceDriverInProcess, ::testing::Values(forceDimension(), openHaptics()),
                         [](const auto& kind) { return kind.param.name(); });

// The program that emulates a device to try haptic-bridge by hand.

class EmulatedHandle : public ::testing::TestWithParam<const char*> {};

TEST_P(EmulatedHandle, PrintsTheCommandThatDrivesItsDevice) {
  Program device({EMULATED_HANDLE_PROGRAM, GetParam()});
  std::string command;
  ASSERT_TRUE(becomesTrue([&] {
    command = device.output();
    return command.find('\n') != std::string::npos;
  })) << device.errors();
  command.resize(command.find('\n'));
  Peer peer;
  Program bridge({"/bin/sh", "-c", command + " --peer " + peer.address()});
  EXPECT_TRUE(becomesTrue([&] { return peer.states() > 0 && !peer.state().fault; })) << bridge.errors();
  EXPECT_FALSE(peer.state().calibrated) << "it waits for the word 'dock'";
  device.signal(SIGTERM);
  EXPECT_EQ(device.wait(), exitedWith(0));
}

INSTANTIATE_TEST_SUITE_P(All, EmulatedHandle,
                         ::testing::Values("force-dimension", "openhaptics", "inverse3"));

TEST(EmulatedHandle, ListsItsWordsWhereItIsNotUnderstood) {
  Program program({EMULATED_HANDLE_PROGRAM, "omega"});
  EXPECT_EQ(program.wait(), exitedWith(64));
  EXPECT_NE(program.errors().find("force-dimension|openhaptics|inverse3"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::test
