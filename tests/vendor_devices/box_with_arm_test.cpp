// SPDX-License-Identifier: Apache-2.0
// A whole box: hapticd, haptic-vendor-bridge and an emulated arm behind a fake library of its vendor, from
// the first opening over a wall that holds the hand, a cable that is pulled and programs that are killed, and
// back.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "rt/base/clock.h"
#include "tests/system/support/bridge_log.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/vendor_devices/bridge_under_test.h"

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

class BoxWithArm : public ::testing::TestWithParam<VendorKind> {
 protected:
  BoxWithArm() : arm_(folder_.path() / "arm", pressingHand()) {
    memory().model = GetParam().model;
    key_ = folder_.write("key", "0123456789abcdef0123456789abcdef");
    ::chmod(key_.c_str(), 0600);
  }

  ArmMemory& memory() { return arm_.memory(); }

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
    bridge_.emplace(std::vector<std::string>{HAPTIC_VENDOR_BRIDGE_PROGRAM, GetParam().word, "--library",
                                             GetParam().library, "--peer", ownLoopback(5) + ":47800",
                                             "--local", ownLoopback(6) + ":47801", "--key-file", key_},
                    ProgramOptions{.environment = {fmt::format("{}={}", kArmVariable,
                                                               (folder_.path() / "arm").string())}});
  }
  static bool handleBecomes(Daemon& daemon, const char* state) {
    return daemon.reaches(
        [state](const nlohmann::json& status) { return status.at("handle").at("state") == state; });
  }
  bool pushes() {
    return becomesTrue([this] { return memory().exerted_n > 0.5; });
  }
  /// Waits until the arm exerts nothing; how long after `since_ns` that was, by the arm's own clock.
  double zeroAfter_ms(std::int64_t since_ns) {
    EXPECT_TRUE(becomesTrue([this] { return memory().exerted_n == 0; }));
    return static_cast<double>(memory().last_exerted_ns - since_ns) * 1e-6;
  }
  /// Engages anew, since a handle that comes back has to be; how long after `since_ns` the wall held the
  /// hand.
  double returnsAfter_ms(std::int64_t since_ns, Daemon& daemon) {
    EXPECT_TRUE(handleBecomes(daemon, "present")) << bridge_->errors();
    EXPECT_TRUE(becomesTrue([&] {
      if (memory().exerted_n > 0.5) return true;
      (void)home_.control({"engage"});
      return false;
    }));
    return static_cast<double>(rt::monotonicNow_ns() - since_ns) * 1e-6;
  }
  void record(const char* what, double zero_ms, double return_ms) {
    RecordProperty(what, fmt::format("zero after {:.1f} ms, back after {:.0f} ms", zero_ms, return_ms));
    fmt::print("{} | {} | {:.1f} | {:.0f}\n", GetParam().word, what, zero_ms, return_ms);
  }

  TemporaryFolder folder_{memoryFolder()};
  EmulatedArm arm_;
  std::string key_;
  DaemonHome home_;
  std::optional<Program> bridge_;
};

TEST_P(BoxWithArm, HoldsTheHandAndLetsItGoWhateverEnds) {
  arm_.setFaults(kArmNotCalibrated);
  std::optional<Daemon> daemon(std::in_place, home_, yaml());
  ASSERT_TRUE(daemon->answers());
  startBridge();
  ASSERT_TRUE(handleBecomes(*daemon, "calibrating")) << bridge_->errors();
  EXPECT_EQ(memory().most_exerted_n, 0);
  memory().docked = true;
  if (GetParam().word == "force-dimension") arm_.setFaults(0);  // the person has initialised it
  ASSERT_TRUE(pushes()) << bridge_->errors();
  EXPECT_EQ(memory().uncalibrated_force_steps, 0U);

  std::int64_t since_ns = rt::monotonicNow_ns();
  arm_.setFaults(kArmUnplugged);
  double zero_ms = zeroAfter_ms(since_ns);
  ASSERT_TRUE(handleBecomes(*daemon, "lost"));
  since_ns = rt::monotonicNow_ns();
  arm_.setFaults(0);
  record("cable", zero_ms, returnsAfter_ms(since_ns, *daemon));

  since_ns = rt::monotonicNow_ns();
  bridge_->signal(SIGKILL);
  (void)bridge_->wait();
  zero_ms = zeroAfter_ms(since_ns);
  constexpr double kWatchdog_ms = 20;
  EXPECT_LE(static_cast<double>(memory().last_exerted_ns - memory().force_ns) * 1e-6,
            kWatchdog_ms + 4e-6 * EmulatedArm::kStep_ns);
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

  EXPECT_LE(memory().most_exerted_n, GetParam().limit_n);
  EXPECT_EQ(memory().uncalibrated_force_steps, 0U);
  bridge_->signal(SIGTERM);
  EXPECT_EQ(bridge_->wait(), exitedWith(0)) << bridge_->errors();
  EXPECT_EQ(memory().exerted_n, 0);
  EXPECT_FALSE(memory().force_on);
}

TEST_P(BoxWithArm, ShowsHowTheToolIsHeldInTheStatus) {
  Daemon daemon(home_, yaml());
  ASSERT_TRUE(daemon.answers());
  startBridge();
  ASSERT_TRUE(pushes()) << bridge_->errors() << daemon.status().dump();
  const nlohmann::json tick = daemon.status().at("tick");
  ASSERT_EQ(tick.at("orientationXyzw").size(), 4U) << tick;
  double length = 0;
  for (const nlohmann::json& part : tick.at("orientationXyzw"))
    length += part.get<double>() * part.get<double>();
  EXPECT_NEAR(length, 1, 1e-9);
  EXPECT_EQ(tick.at("handleGripperRad").is_null(), GetParam().word == "openhaptics");
}

INSTANTIATE_TEST_SUITE_P(All, BoxWithArm, ::testing::Values(forceDimension(), openHaptics()),
                         [](const auto& kind) { return kind.param.name(); });

}  // namespace
}  // namespace hapticd::test
