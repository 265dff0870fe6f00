// SPDX-License-Identifier: Apache-2.0
// A whole box: hapticd, haptic-bridge and a device behind a fake library or service of its vendor,
// from the first opening over a wall that holds the hand, a cable that is pulled and programs that are
// killed, and back.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>

#include "rt/base/clock.h"
#include "tests/system/support/bridge_log.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/vendor_devices/bridge_under_test.h"
#include "tests/vendor_devices/fake_inverse_service.h"
#ifdef HAPTIC_CRTK_BRIDGE_PROGRAM
#include "tests/ros/simulated_crtk_arm.h"
#endif

namespace hapticd::test {
namespace {

/// A hand that presses with 2 N where the world's wall is, 30 mm ahead of where it begins.
drivers::SimulatedHandleSettings pressingHand() {
  drivers::SimulatedHandleSettings hand;
  hand.start_m_in_world = {0, 0, 0};
  hand.direction_in_world = {0, 0, -1};
  hand.travel_m = 0.02;
  return hand;
}

/// A device in that hand, as a test of a whole box needs it. Times: CLOCK_MONOTONIC.
class DeviceInHand {
 public:
  virtual ~DeviceInHand() = default;
  /// The bridge that drives it.
  virtual std::string program() { return HAPTIC_BRIDGE_PROGRAM; }
  /// By which the bridge finds it.
  virtual std::vector<std::string> options() = 0;
  virtual std::vector<std::string> environment() { return {}; }
  virtual double exerted_n() = 0;
  virtual double mostExerted_n() = 0;
  virtual std::int64_t lastExerted_ns() = 0;
  /// When a program made it exert something last.
  virtual std::int64_t lastCommand_ns() = 0;
  virtual bool exertedUncalibrated() = 0;
  /// Whether the program that ended has left it as it is to leave it, and not only without force.
  virtual bool wasLeftInOrder() = 0;
  /// Whether it knows its position.
  virtual void setCalibrated(bool calibrated) = 0;
  virtual void setPlugged(bool plugged) = 0;
};

/// An emulated arm behind the fake library of its vendor.
class LibraryArm final : public DeviceInHand {
 public:
  explicit LibraryArm(VendorKind kind) : kind_(std::move(kind)) { memory().model = kind_.model; }
  std::vector<std::string> options() override { return {kind_.word, "--library", kind_.library}; }
  std::vector<std::string> environment() override {
    return {fmt::format("{}={}", kArmVariable, (folder_.path() / "arm").string())};
  }
  double exerted_n() override { return memory().exerted_n; }
  double mostExerted_n() override { return memory().most_exerted_n; }
  std::int64_t lastExerted_ns() override { return memory().last_exerted_ns; }
  std::int64_t lastCommand_ns() override { return memory().force_ns; }
  bool exertedUncalibrated() override { return memory().uncalibrated_force_steps > 0; }
  bool wasLeftInOrder() override { return !memory().force_on; }
  void setCalibrated(bool calibrated) override {
    memory().docked = calibrated;
    if (!calibrated) arm_.setFaults(kArmNotCalibrated);
    if (calibrated && kind_.word == "force-dimension") arm_.setFaults(0);  // the person has initialised it
  }
  void setPlugged(bool plugged) override { arm_.setFaults(plugged ? 0U : kArmUnplugged); }

 private:
  ArmMemory& memory() { return arm_.memory(); }

  VendorKind kind_;
  TemporaryFolder folder_{memoryFolder()};
  EmulatedArm arm_{folder_.path() / "arm", pressingHand()};
};

/// An Inverse3 behind the fake service of its vendor.
class ServiceArm final : public DeviceInHand {
 public:
  std::vector<std::string> options() override { return {"inverse3", "--address", service_.address()}; }
  double exerted_n() override {
    const double exerted_n = norm(service_.record().exerted_n);
    exerted_uncalibrated_ = exerted_uncalibrated_ || (!calibrated_ && exerted_n > 0);
    return exerted_n;
  }
  double mostExerted_n() override { return service_.record().most_exerted_n; }
  std::int64_t lastExerted_ns() override { return service_.record().last_exerted_ns; }
  std::int64_t lastCommand_ns() override { return service_.record().last_frame_ns; }
  bool exertedUncalibrated() override { return exerted_uncalibrated_; }
  bool wasLeftInOrder() override {
    const InverseServiceRecord seen = service_.record();
    return seen.zero_before_end && seen.clear_before_end && seen.closed_in_order;
  }
  void setCalibrated(bool calibrated) override {
    exerted_uncalibrated_ = exerted_uncalibrated_ || (!calibrated_ && mostExerted_n() > 0);
    calibrated_ = calibrated;
    service_.setFaults(calibrated ? 0U : kNotCalibrated);
  }
  void setPlugged(bool plugged) override { service_.setFaults(plugged ? 0U : kUnplugged); }

 private:
  bool calibrated_ = true;
  bool exerted_uncalibrated_ = false;
  FakeInverseService service_{{.hand = pressingHand()}};
};

#ifdef HAPTIC_CRTK_BRIDGE_PROGRAM
/// An arm that speaks CRTK over DDS, with a watchdog of its own.
class CrtkArm final : public DeviceInHand {
 public:
  std::string program() override { return HAPTIC_CRTK_BRIDGE_PROGRAM; }
  std::vector<std::string> options() override {
    return {"--arm", arm_.name(), "--domain", std::to_string(ownDomain())};
  }
  double exerted_n() override { return norm(arm_.record().exerted_n); }
  double mostExerted_n() override { return arm_.record().most_exerted_n; }
  std::int64_t lastExerted_ns() override { return arm_.record().last_exerted_ns; }
  std::int64_t lastCommand_ns() override { return arm_.record().last_wrench_ns; }
  bool exertedUncalibrated() override { return arm_.record().late_forces > 0; }
  bool wasLeftInOrder() override { return arm_.record().zeros_in_a_row >= 20; }
  void setCalibrated(bool calibrated) override {
    arm_.setState(calibrated ? "ENABLED" : "DISABLED", calibrated);
  }
  void setPlugged(bool plugged) override { arm_.setFaults(plugged ? 0U : kCrtkSilent); }

 private:
  SimulatedCrtkArm arm_{ownDomain(), ownNamespace(), {.watchdog_ns = 50'000'000, .hand = pressingHand()}};
};
#endif

/// A kind of device, and what the box has to keep with it.
struct BoxCase {
  std::string name;
  double limit_n = 0;
  double watchdog_ms = 0;  ///< after which the device drops the force of a program that is gone
  bool has_gripper = false;
  std::unique_ptr<DeviceInHand> (*make)();
};
void PrintTo(const BoxCase& kind, std::ostream* stream) {
  *stream << kind.name;
}

class BoxWithArm : public ::testing::TestWithParam<BoxCase> {
 protected:
  BoxWithArm() : device_(GetParam().make()) {
    key_ = folder_.write("key", "0123456789abcdef0123456789abcdef");
    ::chmod(key_.c_str(), 0600);
  }

  /// A wall 1 m away; the handle's frame is where the hand touches it at the end of its travel.
  std::string yaml() const {
    return fmt::format(
        "safety: {{handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}}\n"
        "camera: {{driver: synthetic}}\n"
        "synthetic: {{scene: plane, noise: off, distance_m: 1}}\n"
        "handle: {{driver: udp, position_z_m: -0.97}}\n"
        "udp_handle: {{address: {}, peer: '{}:47801', key_file: {}}}\n"
        "control: {{engage_at_start: true}}\n",
        ownLoopback(5), ownLoopback(6), key_);
  }
  void startBridge() {
    std::vector<std::string> command = device_->options();
    command.insert(command.begin(), device_->program());
    for (const std::string& word : {std::string("--peer"), ownLoopback(5) + ":47800", std::string("--local"),
                                    ownLoopback(6) + ":47801", std::string("--key-file"), key_})
      command.push_back(word);
    bridge_.emplace(command, ProgramOptions{.environment = device_->environment()});
  }
  static bool handleBecomes(Daemon& daemon, const char* state) {
    return daemon.reaches(
        [state](const nlohmann::json& status) { return status.at("handle").at("state") == state; });
  }
  /// Waits until the wall holds the hand. On a crowded machine a device may report once more that it is not
  /// calibrated, milliseconds after the box has engaged. The law then begins outside, and this hand stays in
  /// the wall: a person disengages and engages, as the warning says.
  bool pushes(Daemon& daemon) {
    return becomesTrue([&] {
      if (device_->exerted_n() > 0.5) return true;
      const std::string warnings = daemon.status().at("warnings").dump();
      if (warnings.find("move the hand out of it, or disengage and engage") != std::string::npos) {
        (void)home_.control({"disengage"});
        (void)home_.control({"engage"});
      }
      return false;
    });
  }
  /// Waits until the arm exerts nothing; how long after `since_ns` that was, by the arm's own clock.
  double zeroAfter_ms(std::int64_t since_ns) {
    EXPECT_TRUE(becomesTrue([this] { return device_->exerted_n() == 0; }));
    return static_cast<double>(device_->lastExerted_ns() - since_ns) * 1e-6;
  }
  /// Engages anew, since a handle that comes back has to be; how long after `since_ns` the wall held the
  /// hand.
  double returnsAfter_ms(std::int64_t since_ns, Daemon& daemon) {
    EXPECT_TRUE(handleBecomes(daemon, "present")) << bridge_->errors();
    EXPECT_TRUE(becomesTrue([&] {
      if (device_->exerted_n() > 0.5) return true;
      (void)home_.control({"engage"});
      return false;
    }));
    return static_cast<double>(rt::monotonicNow_ns() - since_ns) * 1e-6;
  }
  void record(const char* what, double zero_ms, double return_ms) {
    RecordProperty(what, fmt::format("zero after {:.1f} ms, back after {:.0f} ms", zero_ms, return_ms));
    fmt::print("{} | {} | {:.1f} | {:.0f}\n", GetParam().name, what, zero_ms, return_ms);
  }

  TemporaryFolder folder_{memoryFolder()};
  std::unique_ptr<DeviceInHand> device_;
  std::string key_;
  DaemonHome home_;
  std::optional<Program> bridge_;
};

TEST_P(BoxWithArm, HoldsTheHandAndLetsItGoWhateverEnds) {
  device_->setCalibrated(false);
  std::optional<Daemon> daemon(std::in_place, home_, yaml());
  ASSERT_TRUE(daemon->answers());
  startBridge();
  ASSERT_TRUE(handleBecomes(*daemon, "calibrating")) << bridge_->errors();
  EXPECT_EQ(device_->mostExerted_n(), 0);
  device_->setCalibrated(true);
  ASSERT_TRUE(pushes(*daemon)) << bridge_->errors();
  EXPECT_FALSE(device_->exertedUncalibrated());

  std::int64_t since_ns = rt::monotonicNow_ns();
  device_->setPlugged(false);
  double zero_ms = zeroAfter_ms(since_ns);
  ASSERT_TRUE(handleBecomes(*daemon, "lost"));
  since_ns = rt::monotonicNow_ns();
  device_->setPlugged(true);
  record("cable", zero_ms, returnsAfter_ms(since_ns, *daemon));

  since_ns = rt::monotonicNow_ns();
  bridge_->signal(SIGKILL);
  (void)bridge_->wait();
  zero_ms = zeroAfter_ms(since_ns);
  EXPECT_LE(static_cast<double>(device_->lastExerted_ns() - device_->lastCommand_ns()) * 1e-6,
            GetParam().watchdog_ms + 4e-6 * EmulatedArm::kStep_ns);
  ASSERT_TRUE(handleBecomes(*daemon, "lost"));
  since_ns = rt::monotonicNow_ns();
  startBridge();
  record("bridge killed", zero_ms, returnsAfter_ms(since_ns, *daemon));

  since_ns = rt::monotonicNow_ns();
  daemon->signal(SIGKILL);
  (void)daemon->wait();
  zero_ms = zeroAfter_ms(since_ns);
  since_ns = rt::monotonicNow_ns();
  daemon.emplace(home_, yaml());
  ASSERT_TRUE(daemon->answers());
  record("daemon killed", zero_ms, returnsAfter_ms(since_ns, *daemon));

  EXPECT_LE(device_->mostExerted_n(), GetParam().limit_n);
  EXPECT_FALSE(device_->exertedUncalibrated());
  bridge_->signal(SIGTERM);
  EXPECT_EQ(bridge_->wait(), exitedWith(0)) << bridge_->errors();
  EXPECT_TRUE(becomesTrue([this] { return device_->exerted_n() == 0 && device_->wasLeftInOrder(); }));
}

TEST_P(BoxWithArm, ShowsHowTheToolIsHeldInTheStatus) {
  Daemon daemon(home_, yaml());
  ASSERT_TRUE(daemon.answers());
  startBridge();
  ASSERT_TRUE(pushes(daemon)) << bridge_->errors() << daemon.status().dump();
  const nlohmann::json tick = daemon.status().at("tick");
  ASSERT_EQ(tick.at("orientationXyzw").size(), 4U) << tick;
  double length = 0;
  for (const nlohmann::json& part : tick.at("orientationXyzw"))
    length += part.get<double>() * part.get<double>();
  EXPECT_NEAR(length, 1, 1e-9);
  EXPECT_EQ(tick.at("handleGripperRad").is_null(), !GetParam().has_gripper);
}

#ifdef HAPTIC_CRTK_BRIDGE_PROGRAM
INSTANTIATE_TEST_SUITE_P(Crtk, BoxWithArm,
                         ::testing::Values(BoxCase{.name = "CrtkArm",
                                                   .limit_n = 10,
                                                   .watchdog_ms = 50,
                                                   .has_gripper = true,
                                                   .make = []() -> std::unique_ptr<DeviceInHand> {
                                                     return std::make_unique<CrtkArm>();
                                                   }}),
                         [](const auto& kind) { return kind.param.name; });
#endif

INSTANTIATE_TEST_SUITE_P(All, BoxWithArm,
                         ::testing::Values(BoxCase{.name = "ForceDimension",
                                                   .limit_n = forceDimension().limit_n,
                                                   .watchdog_ms = 20,
                                                   .has_gripper = true,
                                                   .make = []() -> std::unique_ptr<DeviceInHand> {
                                                     return std::make_unique<LibraryArm>(forceDimension());
                                                   }},
                                           BoxCase{.name = "OpenHaptics",
                                                   .limit_n = openHaptics().limit_n,
                                                   .watchdog_ms = 20,
                                                   .make = []() -> std::unique_ptr<DeviceInHand> {
                                                     return std::make_unique<LibraryArm>(openHaptics());
                                                   }},
                                           BoxCase{.name = "Inverse3",
                                                   .limit_n = 10,
                                                   .watchdog_ms = 50,
                                                   .make = []() -> std::unique_ptr<DeviceInHand> {
                                                     return std::make_unique<ServiceArm>();
                                                   }}),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace hapticd::test
