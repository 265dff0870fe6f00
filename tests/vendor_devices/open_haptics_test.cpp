// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/vendor_devices/bridge_under_test.h"
#include "tools/haptic-bridge/open_haptics/open_haptics_driver.h"

// haptic-bridge with a fake libHD.so.
namespace hapticd::test {
namespace {

enum Model { kPremium6 = 1, kDesktop = 2 };

VendorKind model(int number) {
  VendorKind kind = openHaptics();
  kind.model = number;
  return kind;
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
  BridgeUnderTest bridge(model(kDesktop));
  bridge.setFaults(kArmNotCalibrated);
  ASSERT_TRUE(bridge.startPushing()) << bridge.program().errors();
  EXPECT_EQ(bridge.memory().uncalibrated_force_steps, 0U);
}

TEST(OpenHaptics, ResetsEncodersAfterThePersonHadTimeToBringTheArmThere) {
  BridgeUnderTest bridge(model(kPremium6));
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

TEST(OpenHaptics, NamesAFunctionThatItsLibraryLacks) {
  VendorKind kind = openHaptics();
  kind.library = HAPTICD_FAKE_HD_WITHOUT_CALIBRATION;
  BridgeUnderTest bridge(kind);
  bridge.start();
  EXPECT_TRUE(bridge.says("has no function hdCheckCalibration")) << bridge.program().errors();
  EXPECT_EQ(bridge.memory().openings, 0U);
}

}  // namespace
}  // namespace hapticd::test
