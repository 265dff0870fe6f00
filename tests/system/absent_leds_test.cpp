// SPDX-License-Identifier: Apache-2.0
// Missing LEDs cause a warning, and nothing else changes.

#include <gtest/gtest.h>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;

const std::string kAbsentLeds =
    std::string(test::kWallYaml) +
    "leds: {driver: gpiod, chip: gpiochip-none, power_line: 0, fault_line: STATUS active-low}\n";

TEST(AbsentLeds, LeaveTheDaemonEngagedWithAWarningAndARemedy) {
  const DaemonHome home;
  Daemon daemon(home, kAbsentLeds, {"control.engage_at_start=true"});
  ASSERT_TRUE(daemon.answers());
  nlohmann::json leds;
  std::string warnings;
  EXPECT_TRUE(daemon.reaches([&](const nlohmann::json& status) {
    leds = status.at("leds");
    warnings = status.at("warnings").dump();
    return status.at("mode") == "engaged" && leds.at("fault") == "slow_blink";
  }));
  EXPECT_EQ(leds.at("state"), "absent");
  EXPECT_EQ(leds.at("identity"), "gpiod gpiochip-none");
  EXPECT_EQ(leds.at("power"), "on");
  EXPECT_TRUE(leds.at("camera").is_null());
  EXPECT_TRUE(contains(warnings, "no such chip"));
  EXPECT_TRUE(
      contains(home.control({"status"}).output, "leds          absent, gpiod gpiochip-none: power on"));
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(AbsentLeds, AreNotMentionedWhereNoneAreConfigured) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  EXPECT_EQ(daemon.status().at("leds").at("state"), "none");
  EXPECT_EQ(home.control({"status"}).output.find("\nleds"), std::string::npos);
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

}  // namespace
}  // namespace hapticd
