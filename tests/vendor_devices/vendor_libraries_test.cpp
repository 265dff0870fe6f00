// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/vendor_devices/bridge_under_test.h"
#include "tools/haptic-bridge/base/device_rows.h"

// haptic-bridge with a fake libdrd.so and a fake libHD.so: what is special to each.
namespace hapticd::test {
namespace {

enum ForceDimensionModel { kOmega3 = 33, kSigma7 = 104 };
enum OpenHapticsModel { kPremium6 = 1, kDesktop = 2 };

VendorKind withModel(VendorKind kind, int number) {
  kind.model = number;
  return kind;
}

TEST(VendorLibrary, IsRefusedWithTheNameOfAFunctionThatItLacks) {
  struct Row {
    VendorKind kind;
    const char* library;
    const char* function;
  };
  for (Row row : {Row{forceDimension(), HAPTICD_FAKE_DRD_WITHOUT_WATCHDOG, "dhdSetWatchdog"},
                  Row{openHaptics(), HAPTICD_FAKE_HD_WITHOUT_CALIBRATION, "hdCheckCalibration"}}) {
    row.kind.library = row.library;
    BridgeUnderTest bridge(row.kind);
    bridge.start();
    EXPECT_TRUE(bridge.says(std::string("has no function ") + row.function)) << bridge.program().errors();
    EXPECT_EQ(bridge.memory().openings, 0U);
  }
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
  BridgeUnderTest bridge(withModel(forceDimension(), kOmega3));
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
  BridgeUnderTest bridge(withModel(forceDimension(), kSigma7));
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
  BridgeUnderTest bridge(withModel(forceDimension(), kOmega3));
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

TEST(ForceDimension, NamesAFileThatIsNoLibrary) {
  const TemporaryFolder folder;
  VendorKind kind = forceDimension();
  kind.library = folder.write("libdrd.so.3", "not a library").string();
  BridgeUnderTest bridge(kind);
  bridge.start();
  EXPECT_TRUE(bridge.says("none can be loaded: " + kind.library)) << bridge.program().errors();
}

TEST(OpenHaptics, HasTheLimitsOfItsModelAndNeverMoreThanTheLibrarySays) {
  using tools::limitsOfHdModel;
  EXPECT_EQ(limitsOfHdModel("Touch", 0, 3).force_n, 3.3);
  EXPECT_EQ(limitsOfHdModel("Touch X", 0, 3).force_n, 7.9);
  EXPECT_EQ(limitsOfHdModel("PHANTOM Omni", 100, 3).force_n, 3.3);
  EXPECT_EQ(limitsOfHdModel("PHANTOM Desktop", 2, 3).force_n, 2);
  EXPECT_EQ(limitsOfHdModel("a new model", 40, 3).force_n, 3.3) << "as the weakest one";
  EXPECT_EQ(limitsOfHdModel("Touch", 0, 3).torque_n_m, 0);
  EXPECT_EQ(limitsOfHdModel("PHANTOM Premium 1.5 6DOF", 0, 6).torque_n_m, 0.188);
}

TEST(OpenHaptics, SaysWhatItIsAndWhatThePersonHasToDo) {
  BridgeUnderTest bridge(openHaptics());
  bridge.setFaults(kArmNotCalibrated);
  bridge.start();
  EXPECT_TRUE(bridge.says("put the stylus into the inkwell")) << bridge.program().errors();
  bridge.memory().docked = true;
  EXPECT_TRUE(bridge.says("Touch ready (serial number A-0042)")) << bridge.program().errors();
}

TEST(OpenHaptics, CalibratesByItselfWhereTheDeviceCan) {
  BridgeUnderTest bridge(withModel(openHaptics(), kDesktop));
  bridge.setFaults(kArmNotCalibrated);
  ASSERT_TRUE(bridge.startPushing()) << bridge.program().errors();
  EXPECT_EQ(bridge.memory().uncalibrated_force_steps, 0U);
}

TEST(OpenHaptics, ResetsEncodersAfterThePersonHadTimeToBringTheArmThere) {
  BridgeUnderTest bridge(withModel(openHaptics(), kPremium6));
  bridge.setFaults(kArmNotCalibrated);
  bridge.peer().command({.force_n = {0, 0, 2}, .torque_n_m = {0.05, 0, -5}});
  bridge.start();
  ASSERT_TRUE(bridge.says("bring the arm to its reset position"));
  EXPECT_EQ(bridge.memory().faults, kArmNotCalibrated) << "not at once";
  ASSERT_TRUE(bridge.pushes()) << bridge.program().errors();
  EXPECT_EQ(bridge.memory().uncalibrated_force_steps, 0U);
  const double x = bridge.memory().torque_n_m[0];
  const double z = bridge.memory().torque_n_m[2];
  EXPECT_NEAR(std::hypot(x, z), 0.188, 1e-9) << "mN m in the library, cut to what the device bears";
  EXPECT_NEAR(x / z, -0.01, 1e-9);
}

TEST(OpenHaptics, RestsWhileItsMotorsAreWarm) {
  BridgeUnderTest bridge(openHaptics());
  ASSERT_TRUE(bridge.startPushing());
  bridge.setFaults(kArmWarm);
  ASSERT_TRUE(bridge.says("its motors are warm; no force for 5 s (1 times so far)"));
  ASSERT_TRUE(bridge.stateBecomes([](const auto& state) { return state.fault; }));
  ASSERT_TRUE(bridge.letsGo());
  ASSERT_TRUE(bridge.passStates(50));
  EXPECT_TRUE(bridge.peer().state().fault) << "all the time";
  bridge.setFaults(0);
  const std::int64_t rested_ns = bridge.memory().last_exerted_ns;
  ASSERT_TRUE(bridge.pushes()) << bridge.program().errors();
  EXPECT_GE(bridge.memory().last_exerted_ns - rested_ns, 4'900'000'000)
      << "5 s, less what passed before it was let go";
}

TEST(OpenHaptics, ExertsNothingAfterACutUntilASmallForceIsCommanded) {
  BridgeUnderTest bridge(openHaptics());
  ASSERT_TRUE(bridge.startPushing());
  bridge.setFaults(kArmForceCut);
  ASSERT_TRUE(bridge.says("has cut its force because of too fast a motion")) << bridge.program().errors();
  bridge.setFaults(0);
  ASSERT_TRUE(bridge.letsGo());
  ASSERT_TRUE(bridge.passStates(200));
  EXPECT_EQ(bridge.memory().exerted_n, 0) << "the same force is still commanded";
  bridge.peer().command({});
  ASSERT_TRUE(bridge.passStates(300));
  bridge.peer().command({.force_n = {0, 0, 2}});
  EXPECT_TRUE(bridge.pushes()) << bridge.program().errors();
}

TEST(OpenHaptics, NamesEachCauseOfACut) {
  for (const auto& [cause, words] :
       {std::pair{0, "too large a force"}, std::pair{1, "too large a change of the force"},
        std::pair{3, "an error of the force"}}) {
    BridgeUnderTest bridge(openHaptics());
    ASSERT_TRUE(bridge.startPushing());
    bridge.memory().cut_cause = cause;
    bridge.setFaults(kArmForceCut);
    EXPECT_TRUE(bridge.says(words)) << bridge.program().errors();
  }
}

TEST(OpenHaptics, OpensADeviceByItsName) {
  BridgeUnderTest bridge(openHaptics());
  bridge.start({"--device", "Default Device"});
  EXPECT_TRUE(bridge.says("ready")) << bridge.program().errors();
  BridgeUnderTest other(openHaptics());
  other.start({"--device", "Left"});
  EXPECT_TRUE(other.says("Left: cannot be opened: device fault (error 0x300)")) << other.program().errors();
}

}  // namespace
}  // namespace hapticd::test
