// SPDX-License-Identifier: Apache-2.0
// The closed loop over DDS: hapticd, haptic-crtk-bridge and a simulated arm with a delay, in a hand that taps
// a wall and leans on it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/ros/ros_listener.h"
#include "tests/ros/simulated_crtk_arm.h"
#include "tests/system/support/bridge_log.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
const std::vector<std::string> kUnprotected{"safety.stiffness_limit=off", "safety.passivity_control=false",
                                            "safety.contact_damping=off"};

/// How the loop went.
struct LoopRun {
  double most_given_j = 0;       ///< as hapticbench stability has it
  double delay_s = 0;            ///< that hapticd counts
  double stiffness_n_per_m = 0;  ///< that remains
  double most_force_n = 0;
};

class CrtkBox : public ::testing::Test {
 protected:
  CrtkBox() {
    key_ = folder_.write("key", "0123456789abcdef0123456789abcdef");
    ::chmod(key_.c_str(), 0600);
  }

  /// A wall 30 mm ahead of where the hand begins.
  std::string yaml() const {
    return fmt::format(
        "safety: {{handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}}\n"
        "camera: {{driver: synthetic}}\n"
        "synthetic: {{scene: plane, noise: off, distance_m: 1}}\n"
        "handle: {{driver: udp, position_z_m: -0.97}}\n"
        "udp_handle: {{address: {}, peer: '{}:47801', key_file: {}}}\n"
        "force: {{law: proxy}}\n"
        "control: {{engage_at_start: true}}\n",
        ownLoopback(5), ownLoopback(6), key_);
  }
  Program bridge() const {
    return Program({HAPTIC_CRTK_BRIDGE_PROGRAM, "--arm", ownNamespace(), "--domain",
                    std::to_string(ownDomain()), "--peer", ownLoopback(5) + ":47800", "--local",
                    ownLoopback(6) + ":47801", "--key-file", key_});
  }
  static CrtkArmSettings delayedArm(std::int64_t delay_ns) {
    CrtkArmSettings settings{
        .period_ns = kMs, .measuring_delay_ns = delay_ns / 2, .driving_delay_ns = delay_ns / 2, .hand = {}};
    settings.hand.script = drivers::HandScript::mixed;
    settings.hand.start_m_in_world = {0, 0, 0};
    settings.hand.direction_in_world = {0, 0, -1};
    settings.hand.travel_m = 0.04;
    return settings;
  }
  LoopRun run(std::int64_t delay_ns, const std::vector<std::string>& set);

  TemporaryFolder folder_{memoryFolder()};
  std::string key_;
  DaemonHome home_;
};

LoopRun CrtkBox::run(std::int64_t delay_ns, const std::vector<std::string>& set) {
  SimulatedCrtkArm arm(ownDomain(), ownNamespace(), delayedArm(delay_ns));
  Daemon daemon(home_, yaml(), set);
  EXPECT_TRUE(daemon.answers());
  Program program = bridge();
  EXPECT_TRUE(daemon.reaches([this](const nlohmann::json& status) {
    // a crowded machine may lose the bridge, and a new session engages only on request
    if (status.at("cause") == "handle_replaced") (void)home_.control({"engage"});
    return status.at("handle").at("state") == "present" && status.at("mode") == "engaged";
  })) << program.errors();
  arm.begin();
  constexpr std::chrono::seconds kDuration{8};
  std::this_thread::sleep_for(kDuration);
  const nlohmann::json tick = daemon.status().at("tick");
  const CrtkArmRecord record = arm.record();
  EXPECT_GT(record.most_exerted_n, 0.5) << "the hand has met the wall";
  return {
      .most_given_j = record.most_given_j,
      .delay_s = tick.at("handleDelayS").get<double>(),
      .stiffness_n_per_m = tick.at("stiffnessNPerM").get<double>() * tick.at("stiffnessGain").get<double>(),
      .most_force_n = record.most_exerted_n};
}

// The hand taps, strokes and leans. A wall that oscillates gives the hand more at each turn; one that is
// stable gives back less than it got. In hapticbench stability, where no tick is late, the shipped settings
// give at most 10 mJ.
TEST_F(CrtkBox, HoldsAHandStablyOverTwoAndTenMillisecondsOfDelay) {
  const auto report = [](const char* what, const LoopRun& run) {
    fmt::print("| {} | {:.1f} | {:.0f} | {:.2f} | {:.2f} |\n", what, 1e3 * run.delay_s, run.stiffness_n_per_m,
               run.most_force_n, 1e3 * run.most_given_j);
  };
  for (const std::int64_t delay_ns : {2 * kMs, 10 * kMs}) {
    const LoopRun run = this->run(delay_ns, {});
    report(fmt::format("{} ms", delay_ns / kMs).c_str(), run);
    EXPECT_LT(run.most_given_j, 0.1);
    EXPECT_GE(run.delay_s, 1e-9 * static_cast<double>(delay_ns) + 1.5e-3) << "less than is built in";
  }
  // Ticks that a crowded machine leaves out are missing in the oscillation, so one calm stretch is enough.
  constexpr int kMaxRuns = 5;
  double free_j = 0;
  for (int i = 0; i < kMaxRuns && !(free_j > 0.5); ++i) {
    const LoopRun run = this->run(10 * kMs, kUnprotected);
    report("10 ms, unprotected", run);
    free_j = std::max(free_j, run.most_given_j);
  }
  EXPECT_GT(free_j, 0.5) << "what it is protected from";
}

}  // namespace
}  // namespace hapticd::test
