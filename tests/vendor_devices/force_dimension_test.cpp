// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/vendor_devices/bridge_under_test.h"
#include "tools/haptic-bridge/force_dimension/force_dimension_driver.h"

// haptic-bridge with a fake libdrd.so.
namespace hapticd::test {
namespace {

enum Model { kOmega3 = 33, kSigma7 = 104 };

VendorKind model(int number) {
  VendorKind kind = forceDimension();
  kind.model = number;
  return kind;
}

TEST(ForceDimension, HasTheLimitsOfItsModelAndCarefulOnesOtherwise) {
  EXPECT_EQ(tools::limitsOfDhdType(63, {}).force_n, 20);
  EXPECT_EQ(tools::limitsOfDhdType(33, {}).force_n, 12);
  EXPECT_EQ(tools::limitsOfDhdType(37, {.gripper = true, .active_gripper = true}).force_n, 12);
  EXPECT_EQ(tools::limitsOfDhdType(37, {.gripper = true, .active_gripper = true}).gripper_force_n, 8);
  EXPECT_EQ(tools::limitsOfDhdType(34, {.wrist = true}).torque_n_m, 0) << "its wrist has no motors";
  EXPECT_GT(tools::limitsOfDhdType(104, {.wrist = true, .active_wrist = true}).torque_n_m, 0);
  EXPECT_LE(tools::limitsOfDhdType(4711, {}).force_n, 8) << "a model that nobody knows";
}

TEST(ForceDimension, SetsTheWatchdogToTheDeadMan) {
  BridgeUnderTest bridge(forceDimension());
  ASSERT_TRUE(bridge.startPushing());
  EXPECT_EQ(bridge.memory().watchdog_ns, 20'000'000);
  EXPECT_TRUE(bridge.says("emulated device ready (serial number 12345)"));
}

TEST(ForceDimension, GetsNoForceWithoutItsWatchdog) {
  BridgeUnderTest bridge(forceDimension());
  bridge.setFaults(kArmNoWatchdog);
  bridge.peer().command({.force_n = {0, 0, 2}});
  bridge.start();
  ASSERT_TRUE(bridge.says("its watchdog is at 0.00 ms instead of 20.00")) << bridge.program().errors();
  ASSERT_TRUE(bridge.passStates(50));
  EXPECT_EQ(bridge.memory().most_exerted_n, 0);
  EXPECT_FALSE(bridge.memory().force_on);
}

TEST(ForceDimension, GetsNoForceBeforeItIsInitialisedWhereItHasNoWrist) {
  BridgeUnderTest bridge(model(kOmega3));
  bridge.setFaults(kArmNotCalibrated);
  bridge.peer().command({.force_n = {0, 0, 2}});
  bridge.start();
  ASSERT_TRUE(bridge.says("does not know its position"));
  ASSERT_TRUE(bridge.passStates(50));
  bridge.setFaults(0);
  EXPECT_TRUE(bridge.pushes());
  EXPECT_EQ(bridge.memory().uncalibrated_force_steps, 0U);
}

TEST(ForceDimension, TellsTheGripperAndDrivesIt) {
  BridgeUnderTest bridge(forceDimension());
  bridge.peer().command({.gripper_force_n = -3});
  bridge.start();
  ASSERT_TRUE(bridge.stateBecomes([](const auto& state) { return state.drives_gripper; }));
  ASSERT_TRUE(becomesTrue([&] { return bridge.memory().gripper_force_n == -3; }));
  const auto state = bridge.peer().state();
  ASSERT_TRUE(state.gripper_rad);
  EXPECT_NEAR(*state.gripper_rad, 0.5, 1e-6) << "as open as a hand without force leaves it";
  EXPECT_FALSE(state.drives_torque);
  bridge.peer().command({.gripper_force_n = 50});
  EXPECT_TRUE(becomesTrue([&] { return bridge.memory().gripper_force_n == 8; }));
}

TEST(ForceDimension, DrivesAnActiveWristUpToItsLimit) {
  BridgeUnderTest bridge(model(kSigma7));
  bridge.peer().command({.torque_n_m = {0.03, 0, -0.04}});
  bridge.start();
  ASSERT_TRUE(becomesTrue([&] { return bridge.memory().torque_n_m[0] != 0; })) << bridge.program().errors();
  EXPECT_DOUBLE_EQ(bridge.memory().torque_n_m[0], 0.03);
  EXPECT_DOUBLE_EQ(bridge.memory().torque_n_m[2], -0.04);
  EXPECT_TRUE(bridge.peer().state().drives_torque);
  bridge.peer().command({.torque_n_m = {0, 5, 0}});
  EXPECT_TRUE(becomesTrue([&] { return bridge.memory().torque_n_m[1] == 0.1; }));
}

TEST(ForceDimension, IsReadAndDrivenWithoutWristAndGripper) {
  BridgeUnderTest bridge(model(kOmega3));
  ASSERT_TRUE(bridge.startPushing());
  const auto state = bridge.peer().state();
  EXPECT_FALSE(state.orientation_in_handle);
  EXPECT_FALSE(state.gripper_rad);
  EXPECT_FALSE(state.drives_gripper);
}

TEST(ForceDimension, IsUsedOnWhereCallsRepeatValuesAndMotorsAreSaturated) {
  BridgeUnderTest bridge(forceDimension());
  bridge.setFaults(kArmRepeats | kArmSaturated);
  ASSERT_TRUE(bridge.startPushing());
  ASSERT_TRUE(bridge.passStates(300));
  EXPECT_EQ(bridge.memory().openings, 1U) << bridge.program().errors();
  EXPECT_EQ(bridge.timesSaid("lost"), 0);
  EXPECT_TRUE(bridge.stateBecomes([](const auto& state) { return !state.fault; }));
  EXPECT_TRUE(bridge.pushes());
}

TEST(ForceDimension, TurnsItsForceOnAgainAfterItWasTooFast) {
  BridgeUnderTest bridge(forceDimension());
  ASSERT_TRUE(bridge.startPushing());
  bridge.memory().cut_cause = 2;
  bridge.setFaults(kArmForceCut);
  ASSERT_TRUE(bridge.says("turned its force off because it was moved too fast")) << bridge.program().errors();
  ASSERT_TRUE(bridge.stateBecomes([](const auto& state) { return state.fault; }));
  bridge.setFaults(0);
  ASSERT_TRUE(bridge.pushes()) << bridge.program().errors();
  ASSERT_TRUE(bridge.stateBecomes([](const auto& state) { return !state.fault; }));
  bridge.setFaults(kArmForceCut);
  EXPECT_TRUE(bridge.says("(2 times so far)"));
}

TEST(ForceDimension, LeavesTheForceButtonToThePerson) {
  BridgeUnderTest bridge(forceDimension());
  ASSERT_TRUE(bridge.startPushing());
  bridge.memory().cut_cause = 1;
  bridge.setFaults(kArmForceCut);
  ASSERT_TRUE(bridge.says("its force button was pressed"));
  ASSERT_TRUE(bridge.stateBecomes([](const auto& state) { return state.fault; }));
  bridge.setFaults(0);  // pressed again
  EXPECT_TRUE(bridge.pushes());
  EXPECT_TRUE(bridge.stateBecomes([](const auto& state) { return !state.fault; }));
}

TEST(ForceDimension, SaysThatItsWatchdogHasTrippedAndGoesOn) {
  BridgeUnderTest bridge(forceDimension());
  ASSERT_TRUE(bridge.startPushing());
  bridge.program().signal(SIGSTOP);
  ASSERT_TRUE(bridge.letsGo());
  bridge.program().signal(SIGCONT);
  EXPECT_TRUE(bridge.says("because no force came for 20 ms")) << bridge.program().errors();
  EXPECT_TRUE(bridge.pushes());
}

TEST(ForceDimension, OpensTheOneOfASerialNumber) {
  BridgeUnderTest bridge(forceDimension());
  bridge.start({"--device", "12345"});
  EXPECT_TRUE(bridge.says("ready")) << bridge.program().errors();
  BridgeUnderTest other(forceDimension());
  other.start({"--device", "4711"});
  EXPECT_TRUE(other.says("cannot be opened")) << other.program().errors();
  BridgeUnderTest wrong(forceDimension());
  wrong.start({"--device", "left"});
  EXPECT_TRUE(wrong.says("\"left\" is no serial number")) << wrong.program().errors();
}

TEST(ForceDimension, RefusesAnOldLibrary) {
  BridgeUnderTest bridge(forceDimension());
  bridge.setFaults(kArmWrongVersion);
  bridge.start();
  EXPECT_TRUE(bridge.says("is version 2.1.0; 3 or newer is needed")) << bridge.program().errors();
  EXPECT_EQ(bridge.memory().openings, 0U);
}

TEST(ForceDimension, NamesAFunctionThatItsLibraryLacks) {
  VendorKind kind = forceDimension();
  kind.library = HAPTICD_FAKE_DRD_WITHOUT_WATCHDOG;
  BridgeUnderTest bridge(kind);
  bridge.start();
  EXPECT_TRUE(bridge.says("has no function dhdSetWatchdog")) << bridge.program().errors();
  EXPECT_EQ(bridge.memory().openings, 0U);
}

TEST(ForceDimension, NamesAFileThatIsNoLibrary) {
  const TemporaryFolder folder;
  VendorKind kind = forceDimension();
  kind.library = folder.write("libdrd.so.3", "not a library").string();
  BridgeUnderTest bridge(kind);
  bridge.start();
  EXPECT_TRUE(bridge.says("none can be loaded: " + kind.library)) << bridge.program().errors();
}

}  // namespace
}  // namespace hapticd::test
