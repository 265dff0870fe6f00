// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>
#include <csignal>
#include <random>

#include "rt/base/clock.h"
#include "tests/vendor_devices/phantom_omni/omni_under_test.h"

// haptic-bridge with a fake libraw1394, behind which an Omni sends and receives packets.
namespace hapticd::test {
namespace {

/// Where the driver has its origin.
constexpr rt::Vec3 kOrigin_m{0, -0.023, 0.168};
/// Encoders resolve 2 pi / 15000 rad, half of it at a reach of at most 0.27 m, for three joints.
constexpr double kEncoder_m = 3 * 0.27 * 3.15 / 15000;

class PhantomOmni : public ::testing::Test {
 protected:
  std::mt19937 random_{7};
  OmniModelSettings settings_ = [this] {
    OmniModelSettings settings;
    settings.n_m_per_count = randomOmniGains(random_);
    return settings;
  }();
  OmniUnderTest bridge_{settings_};
  EmulatedOmni& omni_ = bridge_.omni();
  OmniMemory& memory_ = bridge_.memory();

  double forceResolution_n(const OmniJoints& pose_rad) const;
  bool isAt(const OmniJoints& pose_rad) {
    const rt::Vec3 expected_m = OmniModel::wristAt(pose_rad) - kOrigin_m;
    return bridge_.stateBecomes([&](const auto& state) {
      return !state.fault && state.calibrated && norm(state.position_m_in_handle - expected_m) < kEncoder_m;
    });
  }
};

/// What half a count of each motor exerts.
double PhantomOmni::forceResolution_n(const OmniJoints& pose_rad) const {
  double sum_n = 0;
  for (std::size_t joint = 0; joint < 3; ++joint) {
    OmniJoints half{};
    half[joint] = settings_.n_m_per_count[joint] / 2;
    sum_n += norm(OmniModel::forceOf(pose_rad, half));
  }
  return sum_n;
}

TEST_F(PhantomOmni, WaitsUntilItsStylusIsDocked) {
  omni_.holdAt({0.3, 0.5, 0.1});
  bridge_.start();
  ASSERT_TRUE(bridge_.says("put the stylus into the inkwell")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return !state.fault && !state.calibrated; }));
  ASSERT_TRUE(bridge_.passStates(200));
  EXPECT_FALSE(bridge_.peer().state().calibrated);
  omni_.dock();
  EXPECT_TRUE(bridge_.says(std::string("Phantom Omni ready (serial number ") + kOmniSerial))
      << bridge_.program().errors();
  EXPECT_TRUE(isAt(kOmniDocked_rad));
  EXPECT_EQ(bridge_.timesSaid("put the stylus"), 1);
}

TEST_F(PhantomOmni, IsReadInMetresWithItsButtons) {
  bridge_.start();
  ASSERT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  for (int round = 0; round < 20; ++round) {
    const OmniJoints pose_rad = randomOmniPose(random_);
    const auto pressed = static_cast<std::uint32_t>(round % 4);
    memory_.buttons = pressed;
    omni_.holdAt(pose_rad);
    EXPECT_TRUE(isAt(pose_rad)) << round;
    EXPECT_TRUE(bridge_.stateBecomes([&](const auto& state) { return state.buttons == pressed; })) << round;
  }
  EXPECT_FALSE(bridge_.peer().state().orientation_in_handle) << "the sources contradict each other in it";
  EXPECT_EQ(memory_.other_writes, 0U);
}

TEST_F(PhantomOmni, ExertsNothingWithoutCalibration) {
  bridge_.peer().command({.force_n = {0, 0, 2}});
  bridge_.start();
  ASSERT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.says("forces uncalibrated")) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.says("haptic-bridge calibrate phantom-omni"));
  ASSERT_TRUE(bridge_.passStates(300));
  EXPECT_TRUE(bridge_.isOff());
  EXPECT_EQ(omni_.lastTorque_ns(), 0) << "at no time";
}

TEST_F(PhantomOmni, ExertsWhatIsCommandedInNewtonsInEveryPose) {
  bridge_.calibrate();
  bridge_.start();
  ASSERT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  std::uniform_real_distribution<double> component(-0.8, 0.8);
  for (int round = 0; round < 15; ++round) {
    const OmniJoints pose_rad = randomOmniPose(random_);
    const rt::Vec3 force_n{component(random_), component(random_), component(random_)};
    bridge_.peer().command({});
    ASSERT_TRUE(bridge_.bringTo(pose_rad));
    bridge_.peer().command({.force_n = force_n});
    const double tolerance_n = forceResolution_n(pose_rad) + 0.005 * norm(force_n);
    EXPECT_TRUE(becomesTrue([&] { return norm(omni_.force_n() - force_n) < tolerance_n; }))
        << round << ": " << norm(omni_.force_n() - force_n) << " of " << tolerance_n;
  }
}

TEST_F(PhantomOmni, NeverExertsMoreThanItBears) {
  constexpr double kLimit_n = 3.3;
  std::uniform_real_distribution<double> component(-100, 100);
  bridge_.calibrate();
  bridge_.start();
  ASSERT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  for (int round = 0; round < 8; ++round) {
    const OmniJoints pose_rad = randomOmniPose(random_);
    bridge_.peer().command({});
    ASSERT_TRUE(bridge_.letsGo());
    ASSERT_TRUE(bridge_.bringTo(pose_rad));
    omni_.forgetMostForce();
    bridge_.peer().command({.force_n = {component(random_), component(random_), component(random_)}});
    ASSERT_TRUE(bridge_.pushes());
    ASSERT_TRUE(bridge_.passStates(50));
    EXPECT_LE(omni_.mostForce_n(), 1.005 * kLimit_n + forceResolution_n(pose_rad)) << round;
    for (const auto& dac : memory_.dac) {
      EXPECT_GE(dac, 0);
      EXPECT_LE(dac, 4094);
    }
  }
}

TEST_F(PhantomOmni, IsLeftWithoutForceByAProgramThatIsTerminated) {
  ASSERT_TRUE(bridge_.startPushing()) << bridge_.program().errors();
  bridge_.program().signal(SIGTERM);
  EXPECT_EQ(bridge_.program().wait(), exitedWith(0)) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.isOff()) << "by a packet, not because packets stopped";
  EXPECT_FALSE(memory_.streams);
  EXPECT_EQ(memory_.channels_taken, 0U);
}

TEST_F(PhantomOmni, GetsNoPacketsAnyMoreFromAProgramThatIsKilled) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.program().signal(SIGKILL);
  (void)bridge_.program().wait();
  const std::int64_t gone_ns = rt::monotonicNow_ns();
  EXPECT_TRUE(bridge_.letsGo());
  EXPECT_LE(memory_.packet_ns, gone_ns);
}

TEST_F(PhantomOmni, IsUsedAgainAfterAProgramThatWasKilled) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.program().signal(SIGKILL);
  (void)bridge_.program().wait();
  ASSERT_NE(memory_.channels_taken, 0U) << "nobody has freed them";
  omni_.dock();
  bridge_.start();
  EXPECT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.pushes());
}

TEST_F(PhantomOmni, GetsNoForceWhileTheProgramHasNoCommand) {
  ASSERT_TRUE(bridge_.startPushing());
  bridge_.peer().command({});
  EXPECT_TRUE(bridge_.letsGo());
  EXPECT_GT(memory_.packet_ns, omni_.lastTorque_ns()) << "packets go on";
}

TEST_F(PhantomOmni, GetsNoForceWhileItSendsNothing) {
  ASSERT_TRUE(bridge_.startPushing());
  omni_.setFaults(kOmniSilent);
  ASSERT_TRUE(bridge_.says("sends nothing")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return state.fault; }));
  ASSERT_TRUE(bridge_.letsGo());
  ASSERT_TRUE(bridge_.says("lost: it has sent nothing for 1 s")) << bridge_.program().errors();
  omni_.setFaults(0);
  omni_.dock();
  EXPECT_TRUE(bridge_.pushes()) << "and is opened again: " << bridge_.program().errors();
}

TEST_F(PhantomOmni, IsOpenedAgainAfterAResetOfTheBus) {
  ASSERT_TRUE(bridge_.startPushing());
  omni_.resetBus();
  ASSERT_TRUE(bridge_.says("the FireWire bus was reset")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.letsGo());
  ASSERT_TRUE(bridge_.stateBecomes([](const auto& state) { return !state.fault && !state.calibrated; }));
  omni_.dock();
  EXPECT_TRUE(bridge_.pushes()) << bridge_.program().errors();
  EXPECT_EQ(std::popcount(memory_.channels_taken.load()), 2) << "it has its channels of this generation only";
  EXPECT_EQ(memory_.openings, 2U);
}

TEST_F(PhantomOmni, LeavesChannelsThatOthersTookAfterAReset) {
  ASSERT_TRUE(bridge_.startPushing());
  const std::uint64_t others = memory_.channels_taken;
  omni_.resetBus();
  memory_.channels_taken |= others;
  ASSERT_TRUE(becomesTrue([&] { return memory_.openings == 2; })) << bridge_.program().errors();
  bridge_.program().signal(SIGTERM);
  EXPECT_EQ(bridge_.program().wait(), exitedWith(0));
  EXPECT_EQ(memory_.channels_taken, others);
}

TEST_F(PhantomOmni, IsOpenedAgainAfterItWasUnplugged) {
  ASSERT_TRUE(bridge_.startPushing());
  omni_.setFaults(kOmniUnplugged);
  omni_.resetBus();
  ASSERT_TRUE(bridge_.says("no Phantom Omni is there")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.letsGo());
  omni_.dock();
  omni_.setFaults(0);
  omni_.resetBus();
  EXPECT_TRUE(bridge_.pushes()) << bridge_.program().errors();
  EXPECT_EQ(bridge_.timesSaid("no Phantom Omni is there"), 1);
}

TEST_F(PhantomOmni, IsOpenedAgainAfterItsEncodersHaveSlipped) {
  ASSERT_TRUE(bridge_.startPushing());
  omni_.setFaults(kOmniJump);
  ASSERT_TRUE(bridge_.says("jumped farther than a hand can move it")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.letsGo());
  EXPECT_TRUE(bridge_.says("put the stylus into the inkwell"));
}

TEST_F(PhantomOmni, SaysHowManyOfItsPacketsAreLost) {
  ASSERT_TRUE(bridge_.startPushing());
  omni_.setFaults(kOmniSkips);
  EXPECT_TRUE(bridge_.says("were lost in a second")) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.pushes()) << "half of them are sufficient";
}

TEST_F(PhantomOmni, TakesNothingFromPacketsOfAnotherKindOfDevice) {
  ASSERT_TRUE(bridge_.startPushing());
  omni_.setFaults(kOmniForeign);
  ASSERT_TRUE(bridge_.letsGo());
  EXPECT_TRUE(bridge_.stateBecomes([](const auto& state) { return state.fault; }));
  EXPECT_TRUE(bridge_.says("packets of another kind of device")) << bridge_.program().errors();
}

TEST_F(PhantomOmni, IsOpenedAgainWhenTheBusTakesNoPackets) {
  ASSERT_TRUE(bridge_.startPushing());
  omni_.setFaults(kOmniCannotSend);
  ASSERT_TRUE(bridge_.says("the bus has failed")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.letsGo());
  omni_.setFaults(0);
  omni_.dock();
  EXPECT_TRUE(bridge_.pushes()) << bridge_.program().errors();
}

TEST_F(PhantomOmni, SaysThatTheBusHasNoChannelLeftAndKeepsNone) {
  omni_.setFaults(kOmniNoChannels);
  bridge_.start();
  ASSERT_TRUE(bridge_.says("has no channel left")) << bridge_.program().errors();
  bridge_.program().signal(SIGTERM);
  EXPECT_EQ(bridge_.program().wait(), exitedWith(0));
  EXPECT_EQ(memory_.channels_taken, 0U);
}

TEST_F(PhantomOmni, SaysWhoMayOpenTheBus) {
  omni_.setFaults(kOmniDenied);
  bridge_.start();
  EXPECT_TRUE(bridge_.says("this user may not open it")) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.says("73-vendor-handles.rules"));
  EXPECT_EQ(memory_.openings, 0U);
}

TEST_F(PhantomOmni, IsChosenByItsSerialNumber) {
  bridge_.start({"--device", "10000000001"});
  EXPECT_TRUE(bridge_.says("no Phantom Omni with serial number 10000000001 is there"))
      << bridge_.program().errors();
  bridge_.start({"--device", kOmniSerial});
  EXPECT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
}

TEST_F(PhantomOmni, ExertsNothingWithTheCalibrationOfAnotherOne) {
  bridge_.calibrate();
  memory_.serial_register = kOmniSerialRegister ^ 2U;
  bridge_.peer().command({.force_n = {0, 0, 2}});
  bridge_.start({"--calibration", bridge_.calibrationFile().string()});
  ASSERT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.says(fmt::format("belongs to the device with serial number {}", kOmniSerial)))
      << bridge_.program().errors();
  ASSERT_TRUE(bridge_.passStates(200));
  EXPECT_TRUE(bridge_.isOff());
  EXPECT_EQ(omni_.lastTorque_ns(), 0);
}

TEST_F(PhantomOmni, ExertsNothingIfItWouldKeepItsTorqueWithoutPackets) {
  bridge_.calibrate(false);
  bridge_.peer().command({.force_n = {0, 0, 2}});
  bridge_.start();
  ASSERT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  EXPECT_TRUE(bridge_.says("keeps its torque when packets stop")) << bridge_.program().errors();
  ASSERT_TRUE(bridge_.passStates(200));
  EXPECT_TRUE(bridge_.isOff());
  EXPECT_EQ(omni_.lastTorque_ns(), 0);
}

TEST_F(PhantomOmni, StatesTheDelayOfThePacketsThatWait) {
  bridge_.start();
  ASSERT_TRUE(bridge_.becomesReady()) << bridge_.program().errors();
  constexpr std::int64_t kWaiting_ns = 5 * 125'000;
  ASSERT_TRUE(bridge_.passStates(50));
  EXPECT_GE(bridge_.peer().state().device_latency_ns, kWaiting_ns);
}

}  // namespace
}  // namespace hapticd::test
