// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include "rt/base/clock.h"
#include "tests/support/program.h"
#include "tests/vendor_devices/fake_inverse_service.h"
#include "tools/haptic-bridge/base/device_rows.h"
#include "tools/haptic-bridge/inverse3/service_messages.h"
#include "tools/lib/device/threaded_device.h"

// The driver of the Inverse3 with a fake service, over real sockets.
namespace hapticd::tools::inverse3 {
namespace {

using test::becomesTrue;
using test::FakeInverseService;
using test::InverseServiceRecord;
using test::InverseServiceSettings;

/// A device in a loop like the bridge's, which commands nothing while the device has a fault.
class DrivenLoop {
 public:
  explicit DrivenLoop(const FakeInverseService& service, const std::string& device_id = "")
      : device_(makeInverse3Driver({.library = "", .device = device_id, .address = service.address()}),
                "test") {
    EXPECT_TRUE(device_.start());
    thread_ = std::thread([this] { run(); });
  }
  ~DrivenLoop() {
    ends_ = true;
    thread_.join();
  }
  DrivenLoop(const DrivenLoop&) = delete;
  DrivenLoop& operator=(const DrivenLoop&) = delete;

  void command(const rt::Vec3& force_n) {
    const std::lock_guard lock(mutex_);
    force_n_ = force_n;
  }
  /// The loop stops as one that hangs.
  void hang() { hangs_ = true; }
  DeviceReading reading() {
    const std::lock_guard lock(mutex_);
    return reading_;
  }
  double limit_n() {
    const std::lock_guard lock(mutex_);
    return limits_.force_n;
  }
  bool isHealthy() { return !reading().fault; }
  /// Waits for a reading without a fault of which `condition` holds; a fault if there is none.
  template <typename Condition>
  DeviceReading healthyReading(Condition condition) {
    DeviceReading last;
    becomesTrue([&] {
      last = reading();
      return !last.fault && condition(last);
    });
    return last;
  }

 private:
  void run() {
    while (!ends_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (hangs_) continue;
      const std::lock_guard lock(mutex_);
      reading_ = device_.read();
      limits_ = device_.limits();
      const bool may = !reading_.fault && reading_.calibrated;
      DeviceCommand command;
      if (may) command.force_n = force_n_;
      device_.exert(command);
    }
  }

  ThreadedDevice device_;
  std::mutex mutex_;
  rt::Vec3 force_n_;
  DeviceReading reading_ = [] {
    DeviceReading none;
    none.fault = true;
    return none;
  }();
  DeviceLimits limits_;
  std::atomic<bool> hangs_{false};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

/// Whether the hand gets about that much, in the end.
bool comesToExert(FakeInverseService& service, double force_n) {
  constexpr double kToleranceN = 1e-3;  // of a filter's tail
  return becomesTrue([&] { return std::abs(norm(service.record().exerted_n) - force_n) < kToleranceN; });
}

TEST(Inverse3, ReportsPlaceGripAndButtonsInTheUnitsOfTheService) {
  FakeInverseService service({.fixed_m = rt::Vec3{0.012, -0.125, 0.25}});
  DrivenLoop loop(service);
  const DeviceReading reading =
      loop.healthyReading([](const DeviceReading& newest) { return newest.orientation.has_value(); });
  ASSERT_TRUE(reading.orientation);
  EXPECT_FALSE(reading.fault);
  EXPECT_EQ(reading.position_m, (rt::Vec3{0.012, -0.125, 0.25}));
  EXPECT_FALSE(reading.velocity_valid) << "hapticd computes one that it knows the lag of";
  EXPECT_EQ(reading.buttons, 5U) << "a and c";
  // the fake turns it by less than 0.2 of a half turn's tangent about x
  EXPECT_NEAR(reading.orientation->x / reading.orientation->w, 0.15, 0.051);
  EXPECT_EQ(reading.orientation->y, 0);
  EXPECT_FALSE(reading.gripper_rad);
  EXPECT_TRUE(reading.calibrated);
  EXPECT_EQ(loop.limit_n(), 10);
}

TEST(Inverse3, HasNoOrientationWithoutAGripAndOneButtonOfAWiredOne) {
  {
    FakeInverseService service({.grip = ""});
    DrivenLoop loop(service);
    ASSERT_TRUE(becomesTrue([&] { return loop.isHealthy() && service.record().frames > 100; }));
    EXPECT_FALSE(loop.reading().orientation);
    EXPECT_EQ(loop.reading().buttons, 0U);
  }
  FakeInverseService service({.grip = "verse_grip"});
  DrivenLoop loop(service);
  const auto held = [](const DeviceReading& newest) { return newest.orientation.has_value(); };
  EXPECT_EQ(loop.healthyReading(held).buttons, 1U);
}

TEST(Inverse3, DoesNotPassOnTheOrientationOfAGripThatFellAsleep) {
  FakeInverseService service;
  DrivenLoop loop(service);
  ASSERT_TRUE(becomesTrue([&] { return loop.reading().orientation.has_value(); }));
  service.setFaults(test::kGripAsleep);
  const DeviceReading reading =
      loop.healthyReading([](const DeviceReading& newest) { return !newest.orientation; });
  ASSERT_FALSE(reading.fault || reading.orientation);
  EXPECT_EQ(reading.buttons, 0U);
  service.setFaults(0);
  EXPECT_TRUE(becomesTrue([&] { return loop.reading().orientation.has_value(); }));
}

TEST(Inverse3, DrivesTheDeviceThatIsNamed) {
  FakeInverseService service;
  DrivenLoop loop(service, FakeInverseService::kOtherDevice);
  EXPECT_EQ(loop.healthyReading([](const DeviceReading&) { return true; }).position_m,
            (rt::Vec3{0.1, 0.1, 0.1}));
  loop.command({1, 0, 0});
  const std::uint64_t frames = service.record().frames;
  ASSERT_TRUE(becomesTrue([&] { return service.record().frames > frames + 100; }));
  EXPECT_EQ(service.record().most_exerted_n, 0) << "the other device was not asked for";
}

TEST(Inverse3, ExertsTheForceInEachKeyForm) {
  const rt::Vec3 force_n{1, -0.5, 0.25};
  for (const auto& [version, key] :
       {std::pair("3.1.2.0", "values"), std::pair("3.4.0.0", "values"), std::pair("3.5.1.0", "vector")}) {
    FakeInverseService service({.version = version, .envelope = true, .key = key});
    DrivenLoop loop(service);
    loop.command(force_n);
    EXPECT_TRUE(comesToExert(service, norm(force_n))) << version;
    EXPECT_EQ(service.record().commanded_n, force_n) << version;
    EXPECT_EQ(service.record().connections, 1U) << version;
  }
}

TEST(Inverse3, TriesTheOtherKeyFormOnceWhereTheVersionLies) {
  FakeInverseService service({.version = "3.5.0", .key = "values"});
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  EXPECT_TRUE(comesToExert(service, 1));
  EXPECT_EQ(service.record().connections, 2U);
}

TEST(Inverse3, RefusesAServiceThatIgnoresForcesInBothForms) {
  FakeInverseService service({.key = ""});
  service.setFaults(test::kNoEcho);
  DrivenLoop loop(service);
  loop.command({0, 0, 3});
  ASSERT_TRUE(becomesTrue([&] {
    const InverseServiceRecord record = service.record();
    return record.connections == 2 && record.open_connections == 0;
  }));
  EXPECT_GT(service.record().most_exerted_n, 0) << "the check needs a force";
  EXPECT_LE(service.record().most_exerted_n, EchoCheck::kUnproven_n);
  EXPECT_TRUE(becomesTrue([&] { return !loop.isHealthy(); }));
  // Repaired, as another version. Nothing but GET /version has come before that.
  std::this_thread::sleep_for(2 * ThreadedDevice::kRetry);
  EXPECT_EQ(service.record().connections, 2U);
  service.setFaults(0);
  service.setVersion("3.5.9");
  EXPECT_TRUE(comesToExert(service, 3));
}

TEST(Inverse3, CommandsZeroUntilTheServiceIsQuiet) {
  FakeInverseService service;
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  ASSERT_TRUE(comesToExert(service, 1));
  EXPECT_GE(service.record().frames_before_force, static_cast<std::uint64_t>(EchoCheck::kNeeded));
}

TEST(Inverse3, DrivesNoServiceThatPushesByItself) {
  FakeInverseService service;
  service.setFaults(test::kPushes);
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  ASSERT_TRUE(becomesTrue([&] { return service.record().connections >= 2; }));
  EXPECT_EQ(service.record().commanded_n, rt::Vec3{});
  EXPECT_FALSE(loop.isHealthy());
}

TEST(Inverse3, StaysWithinTheLimitOfTheDeviceWhateverIsCommanded) {
  for (const auto& [type, limit_n] : {std::pair("inverse3", 10.0), std::pair("minverse", 2.0)}) {
    FakeInverseService service({.type = type});
    DrivenLoop loop(service);
    loop.command({0, 30, -40});
    EXPECT_TRUE(comesToExert(service, limit_n));
    loop.command({std::nan(""), 0, 0});
    EXPECT_TRUE(comesToExert(service, 0));
    EXPECT_LE(service.record().most_exerted_n, limit_n * (1 + 1e-12)) << "rounding";
    EXPECT_EQ(loop.limit_n(), limit_n);
  }
}

TEST(Inverse3, AcceptsThatFiltersOfTheServiceWeakenAndDelayTheForce) {
  FakeInverseService service({.force_gate_gain = 0.3, .force_scale = 0.5});
  DrivenLoop loop(service);
  loop.command({0, 0, 4});
  EXPECT_TRUE(comesToExert(service, 2));
  EXPECT_EQ(service.record().connections, 1U);
}

TEST(Inverse3, CountsTheDelayOfServiceAndForceGate) {
  constexpr std::int64_t kAnswerDelayNs = 4'000'000;
  // of y += g (x - y) each millisecond: (1 - g) / g steps
  constexpr std::int64_t kGateDelayNs = 2'333'333;
  FakeInverseService service({.force_gate_gain = 0.3, .answer_delay_ns = kAnswerDelayNs});
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  ASSERT_TRUE(comesToExert(service, 1));
  const DeviceReading reading = loop.healthyReading([](const DeviceReading&) { return true; });
  ASSERT_FALSE(reading.fault);
  // one for the age of the state, which the exchange adds, and one until the next force takes effect
  EXPECT_GE(reading.latency_ns, 2 * kAnswerDelayNs + kGateDelayNs - 1);
}

TEST(Inverse3, AsksAtMostOncePerMillisecondAndOneFrameAtATime) {
  FakeInverseService service({.answer_delay_ns = 3'000'000});
  DrivenLoop loop(service);
  ASSERT_TRUE(becomesTrue([&] { return service.record().frames > 200; }));
  const InverseServiceRecord record = service.record();
  EXPECT_LE(record.most_outstanding, 2U) << "a zero after 20 ms, where this machine stalls";
  FakeInverseService quick;
  DrivenLoop quick_loop(quick);
  ASSERT_TRUE(becomesTrue([&] { return quick.record().frames > 500; }));
  const InverseServiceRecord quick_record = quick.record();
  const auto passed_ms =
      static_cast<std::uint64_t>((quick_record.last_frame_ns - quick_record.connected_ns) / 1'000'000);
  EXPECT_LE(quick_record.frames, passed_ms + passed_ms / 20 + 2) << "zeros after 20 ms without an answer";
}

TEST(Inverse3, LetsGoWhenTheBridgesLoopHangs) {
  FakeInverseService service;
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  ASSERT_TRUE(comesToExert(service, 1));
  loop.hang();
  EXPECT_TRUE(comesToExert(service, 0));
  const std::uint64_t frames = service.record().frames;
  EXPECT_TRUE(becomesTrue([&] { return service.record().frames > frames + 100; })) << "it goes on with zero";
  EXPECT_EQ(service.record().exerted_n, rt::Vec3{});
}

TEST(Inverse3, CommandsZeroToAServiceThatAnswersTooSlowlyAndGoesOnWhenItIsQuickAgain) {
  FakeInverseService service({.idle_ns = 3'600'000'000'000});
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  ASSERT_TRUE(comesToExert(service, 1));
  service.setAnswerDelay(60'000'000);
  EXPECT_TRUE(comesToExert(service, 0));
  EXPECT_TRUE(becomesTrue([&] { return !loop.isHealthy(); }));
  service.setAnswerDelay(0);
  EXPECT_TRUE(comesToExert(service, 1));
}

TEST(Inverse3, LetsGoOfAServiceThatAnswersNoMore) {
  FakeInverseService service({.idle_ns = 3'600'000'000'000});
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  ASSERT_TRUE(comesToExert(service, 1));
  service.setFaults(test::kSilent);
  EXPECT_TRUE(comesToExert(service, 0)) << "it still takes frames";
  EXPECT_TRUE(becomesTrue([&] { return !loop.isHealthy(); }));
  service.setFaults(0);
  EXPECT_TRUE(comesToExert(service, 1)) << "opened again";
}

TEST(Inverse3, EndsAlthoughTheServiceHangsWhereverItIs) {
  const auto ends = [](std::uint32_t faults, bool driven_before) {
    FakeInverseService service;
    if (!driven_before) service.setFaults(faults);
    auto loop = std::make_unique<DrivenLoop>(service);
    if (driven_before) {
      EXPECT_TRUE(becomesTrue([&] { return loop->isHealthy(); }));
      service.setFaults(faults);
    }
    loop.reset();  // a hang is the time limit of the test
  };
  ends(test::kSilent, true);
  ends(test::kSilent, false);
  ends(test::kRefuses, false);
  ends(test::kGarbage, true);
}

TEST(Inverse3, WorksWithoutTheEventChannel) {
  FakeInverseService service({.event_channel = false});
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  EXPECT_TRUE(comesToExert(service, 1));
}

TEST(Inverse3, DoesNotDriveThroughATransformThatScales) {
  FakeInverseService service({.workspace_scale = 2});
  DrivenLoop loop(service);
  ASSERT_TRUE(becomesTrue([&] { return service.record().connections >= 2; }));
  EXPECT_EQ(service.record().frames, 0U);
  EXPECT_FALSE(loop.isHealthy());
}

TEST(Inverse3, ExertsNothingWhileTheDeviceIsNotCalibrated) {
  FakeInverseService service;
  service.setFaults(test::kNotCalibrated);
  DrivenLoop loop(service);
  loop.command({0, 0, 1});
  ASSERT_TRUE(becomesTrue([&] { return loop.isHealthy() && !loop.reading().calibrated; }));
  EXPECT_EQ(service.record().most_exerted_n, 0);
  service.setFaults(0);
  EXPECT_TRUE(comesToExert(service, 1));
}

}  // namespace
}  // namespace hapticd::tools::inverse3
