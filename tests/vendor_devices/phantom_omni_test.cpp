// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <csignal>
#include <random>

#include "rt/base/clock.h"
#include "tests/vendor_devices/omni_under_test.h"

// haptic-vendor-bridge with a fake libraw1394, behind which an Omni sends and receives packets.
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

  bool isAt(const OmniJoints& pose_rad) {
    const rt::Vec3 expected_m = OmniModel::wristAt(pose_rad) - kOrigin_m;
    return bridge_.stateBecomes([&](const auto& state) {
      return !state.fault && state.calibrated && norm(state.position_m_in_handle - expected_m) < kEncoder_m;
    });
  }
};

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
  EXPECT_TRUE(bridge_.says("haptic-vendor-bridge calibrate phantom-omni"));
  ASSERT_TRUE(bridge_.passStates(300));
  EXPECT_TRUE(bridge_.isOff());
  EXPECT_EQ(omni_.lastTorque_ns(), 0) << "at no time";
}

}  // namespace
}  // namespace hapticd::test
