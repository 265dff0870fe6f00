// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <memory>
#include <thread>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tools/haptic-bridge/base/vendor_library.h"
#include "tools/lib/device/threaded_device.h"

// What passes between the bridge's loop and the thread that drives a device, at times that the test sets.
namespace hapticd::tools {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr DeviceLimits kLimits{.force_n = 5, .torque_n_m = 0.1, .gripper_force_n = 2};

DeviceReading at(double x_m) {
  DeviceReading reading;
  reading.position_m = {x_m, 0, 0};
  return reading;
}
DeviceCommand pushing(double force_n) {
  return {.force_n = {0, 0, force_n}, .torque_n_m = {}};
}

class Exchange : public ::testing::Test {
 protected:
  /// One round: the device measures, the bridge answers with 2 N, and the device takes that.
  double roundAt(std::int64_t now_ns) {
    exchange_.publish(at(0), now_ns);
    (void)exchange_.newest(now_ns);
    exchange_.command(pushing(2), now_ns);
    return exchange_.commandAt(now_ns).force_n.z;
  }
  DeviceExchange exchange_;
};

TEST_F(Exchange, WaitsForCalibrationBetweenTwoOpeningsOfADeviceThatIsThere) {
  exchange_.open({});
  EXPECT_EQ(roundAt(kMs), 0) << "it may exert nothing yet";
  exchange_.open(kLimits);
  EXPECT_FALSE(exchange_.newest(2 * kMs).fault);
  EXPECT_FALSE(exchange_.newest(2 * kMs).calibrated);
  exchange_.command(pushing(2), 2 * kMs);
  EXPECT_EQ(exchange_.commandAt(2 * kMs).force_n.z, 0) << "it answers no reading of this opening";
  EXPECT_EQ(roundAt(3 * kMs), 2);
}

TEST_F(Exchange, PassesReadingsAndCommandsWhileItIsOpen) {
  EXPECT_TRUE(exchange_.newest(0).fault);
  EXPECT_EQ(roundAt(kMs), 0);
  EXPECT_EQ(exchange_.limits().force_n, 0);
  exchange_.open(kLimits);
  EXPECT_TRUE(exchange_.newest(2 * kMs).fault) << "the reading is from before";
  EXPECT_EQ(exchange_.limits().force_n, 5);
  EXPECT_EQ(roundAt(3 * kMs), 2);
  EXPECT_FALSE(exchange_.newest(3 * kMs).fault);
  exchange_.close();
  EXPECT_TRUE(exchange_.newest(3 * kMs).fault);
  EXPECT_EQ(exchange_.commandAt(3 * kMs).force_n.z, 0);
}

TEST_F(Exchange, DropsACommandThatIsOlderThanTheDeadMan) {
  exchange_.open(kLimits);
  ASSERT_EQ(roundAt(kMs), 2);
  exchange_.publish(at(0), 20 * kMs);
  EXPECT_EQ(exchange_.commandAt(kMs + kDeadManNs - 1).force_n.z, 2);
  EXPECT_EQ(exchange_.commandAt(kMs + kDeadManNs).force_n.z, 0);
}

TEST_F(Exchange, CallsAReadingThatIsOlderThanTheDeadManAFaultAndDropsWhatAnswersIt) {
  exchange_.open(kLimits);
  ASSERT_EQ(roundAt(kMs), 2);
  EXPECT_FALSE(exchange_.newest(kMs + kDeadManNs).fault);
  EXPECT_TRUE(exchange_.newest(kMs + kDeadManNs + 1).fault);
  exchange_.command(pushing(2), kMs + kDeadManNs + 1);
  EXPECT_EQ(exchange_.commandAt(kMs + kDeadManNs + 1).force_n.z, 0);
}

TEST_F(Exchange, LetsNoCommandOfAnEarlierOpeningAct) {
  exchange_.open(kLimits);
  ASSERT_EQ(roundAt(kMs), 2);
  exchange_.close();
  exchange_.open(kLimits);
  exchange_.publish(at(0), 2 * kMs);
  EXPECT_EQ(exchange_.commandAt(2 * kMs).force_n.z, 0) << "written a millisecond ago";
  exchange_.command(pushing(3), 2 * kMs);
  EXPECT_EQ(exchange_.commandAt(2 * kMs).force_n.z, 0) << "written now, in answer to the reading of before";
  (void)exchange_.newest(2 * kMs);
  exchange_.command(pushing(3), 2 * kMs);
  EXPECT_EQ(exchange_.commandAt(2 * kMs).force_n.z, 3);
}

TEST_F(Exchange, LetsNothingActOnADeviceThatIsFaultyOrNotCalibrated) {
  exchange_.open(kLimits);
  for (const bool calibrated : {true, false}) {
    ASSERT_EQ(roundAt(kMs), 2);
    DeviceReading bad = at(0);
    bad.fault = calibrated;
    bad.calibrated = calibrated;
    exchange_.publish(bad, 2 * kMs);
    EXPECT_EQ(exchange_.commandAt(2 * kMs).force_n.z, 0) << "at once, before the bridge knows";
    (void)exchange_.newest(2 * kMs);
    exchange_.command(pushing(2), 2 * kMs);
    exchange_.publish(at(0), 3 * kMs);
    EXPECT_EQ(exchange_.commandAt(3 * kMs).force_n.z, 0) << "it answers the bad reading";
  }
}

TEST_F(Exchange, BoundsWhatIsCommandedByTheLimitsOfTheDevice) {
  exchange_.open(kLimits);
  exchange_.publish(at(0), kMs);
  (void)exchange_.newest(kMs);
  exchange_.command({.force_n = {30, 0, 40}, .torque_n_m = {0, 7, 0}, .gripper_force_n = -9}, kMs);
  DeviceCommand taken = exchange_.commandAt(kMs);
  EXPECT_DOUBLE_EQ(taken.force_n.x, 3);
  EXPECT_DOUBLE_EQ(taken.force_n.z, 4);
  EXPECT_DOUBLE_EQ(taken.torque_n_m.y, 0.1);
  EXPECT_EQ(taken.gripper_force_n, -2);
  exchange_.command({.force_n = {kNan, 0, 0}, .torque_n_m = {0, kNan, 0}, .gripper_force_n = kNan}, kMs);
  taken = exchange_.commandAt(kMs);
  EXPECT_EQ(taken.force_n, rt::Vec3{});
  EXPECT_EQ(taken.torque_n_m, rt::Vec3{});
  EXPECT_EQ(taken.gripper_force_n, 0);
}

TEST_F(Exchange, PassesNothingThatIsNoNumber) {
  exchange_.open(kLimits);
  ASSERT_EQ(roundAt(kMs), 2);
  DeviceReading bad = at(kNan);
  bad.orientation = rt::Quaternion{kNan, 0, 0, 1};
  bad.gripper_rad = kNan;
  bad.velocity_valid = true;
  bad.velocity_m_per_s = {0, kNan, 0};
  EXPECT_EQ(exchange_.publish(bad, 2 * kMs), ReadingVerdict::not_finite);
  EXPECT_EQ(exchange_.commandAt(2 * kMs).force_n.z, 0);
  const DeviceReading passed = exchange_.newest(2 * kMs);
  EXPECT_TRUE(passed.fault);
  EXPECT_EQ(passed.position_m, rt::Vec3{}) << "the last one that was a number";
  EXPECT_FALSE(passed.orientation);
  EXPECT_FALSE(passed.gripper_rad);
  EXPECT_FALSE(passed.velocity_valid);
  EXPECT_EQ(passed.velocity_m_per_s, rt::Vec3{});
}

TEST_F(Exchange, CallsAMotionThatNoHandMakesAJump) {
  exchange_.open(kLimits);
  ASSERT_EQ(roundAt(kMs), 2);
  EXPECT_EQ(exchange_.publish(at(0.01), 2 * kMs), ReadingVerdict::taken_over) << "10 m/s";
  EXPECT_EQ(exchange_.publish(at(0.08), 3 * kMs), ReadingVerdict::jumped);
  EXPECT_TRUE(exchange_.newest(3 * kMs).fault);
  EXPECT_EQ(exchange_.newest(3 * kMs).position_m.x, 0.01);
  EXPECT_EQ(exchange_.commandAt(3 * kMs).force_n.z, 0);
  EXPECT_EQ(exchange_.publish(at(0.3), 2 * kMs + kDeadManNs), ReadingVerdict::taken_over)
      << "nobody knows how it has moved meanwhile";
  exchange_.open(kLimits);
  EXPECT_EQ(exchange_.publish(at(-0.3), 3 * kMs + kDeadManNs), ReadingVerdict::taken_over)
      << "another opening may have another origin";
}

TEST_F(Exchange, AddsTheDelayOfBothDirectionsToThatOfTheDevice) {
  exchange_.open(kLimits);
  DeviceReading reading = at(0);
  reading.latency_ns = 100;
  for (std::int64_t now_ns = kMs; now_ns < 300 * kMs; now_ns += kMs) {
    exchange_.publish(reading, now_ns - 30'000);
    (void)exchange_.newest(now_ns);
    exchange_.command(pushing(1), now_ns);
    (void)exchange_.commandAt(now_ns + 7'000);
  }
  EXPECT_EQ(exchange_.newest(300 * kMs).latency_ns, 30'000 + 7'000 + 100);
}

TEST(VersionsOf, ComeInTheOrderOfTheirNumbers) {
  const test::TemporaryFolder folder;
  for (const char* name :
       {"lib.so", "lib.so.3.9.0", "lib.so.3.17.1", "lib.so.3.17.0", "libother.so", "lib.sod"})
    folder.write(name, "");
  const std::string in = folder.path().string() + "/";
  EXPECT_EQ(versionsOf(folder.path().string(), "lib.so"),
            (std::vector<std::string>{in + "lib.so.3.17.1", in + "lib.so.3.17.0", in + "lib.so.3.9.0",
                                      in + "lib.so"}));
  EXPECT_TRUE(versionsOf(in + "none", "lib.so").empty());
}

/// A driver whose device is lost as soon as it is open, and which says so with the same words.
class LosingDriver final : public DeviceDriver {
 public:
  explicit LosingDriver(std::atomic<int>& attempts) : attempts_(attempts) {}
  base::Result<void> drive(DeviceSession& session) override {
    if (++attempts_ % 2 == 0) session.opened({.model = "thing", .serial = {}, .limits = kLimits});
    return std::unexpected(base::Error{"thing", "is lost", ""});
  }

 private:
  std::atomic<int>& attempts_;
};

TEST(ThreadedDevice, SaysWhatIsWrongOnceAndAgainAfterItWasOpened) {
  std::atomic<int> attempts{0};
  ::testing::internal::CaptureStderr();
  {
    ThreadedDevice device(std::make_unique<LosingDriver>(attempts), "bridge");
    ASSERT_TRUE(device.start());
    EXPECT_TRUE(test::becomesTrue([&] { return attempts == 4; }));
    EXPECT_TRUE(device.read().fault);
    EXPECT_EQ(device.limits().force_n, 0);
  }
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_TRUE(
      said.starts_with("bridge: thing: is lost\nbridge: thing ready\nbridge: thing: is lost\n"
                       "bridge: thing ready\nbridge: thing: is lost\n"))
      << said;
}

}  // namespace
}  // namespace hapticd::tools
