// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <thread>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/vendor_devices/bridge_under_test.h"
#include "tools/haptic-bridge/device_rows.h"
#include "tools/lib/device/threaded_device.h"

// The drivers in this process, in the place of the bridge's loop.
namespace hapticd::test {
namespace {

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

TEST_P(DeviceDriverInProcess, LeavesTheDeviceWithoutForceAndCanBeUsedAgain) {
  for (const std::uint64_t openings : {1U, 2U}) {
    {
      tools::ThreadedDevice device(driverOf(GetParam()), "test");
      ASSERT_TRUE(device.start());
      ASSERT_TRUE(pushes(device));
      EXPECT_EQ(device.limits().force_n, GetParam().limit_n);
      EXPECT_EQ(arm_.memory().openings, openings) << "the library stays loaded";
    }
    ASSERT_TRUE(becomesTrue([&] { return arm_.memory().exerted_n == 0; }));
  }
  EXPECT_FALSE(arm_.memory().force_on);
  for (const auto& force_n : arm_.memory().force_n) EXPECT_EQ(force_n, 0);
}

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

}  // namespace
}  // namespace hapticd::test
