// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <iostream>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using test::Daemon;
using test::DaemonHome;

/// The user to run as, who may neither use real-time scheduling nor lock memory: `nobody` for root, else
/// the user who runs the tests.
test::ProgramOptions ordinaryUser(const DaemonHome& home) {
  if (::geteuid() != 0) return {};
  constexpr uid_t kNobody = 65534;
  home.giveTo(kNobody);
  return {.user = kNobody};
}

TEST(UnprivilegedDaemon, RunsAndSaysHonestlyWhatItCouldNotGet) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, {}, ordinaryUser(home));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.ticks());
  const nlohmann::json status = daemon.status();
  const std::string warnings = status.at("warnings").dump();
  const bool scheduled = status.at("loop").at("realtimeScheduling");
  const bool locked = status.at("loop").at("memoryLocked");
  if (::geteuid() == 0) {  // then the daemon runs as a user who has neither
    EXPECT_FALSE(scheduled);
    EXPECT_FALSE(locked);
  } else {
    std::cerr << "not root: what this user may do decides what is warned of\n";
  }
  // In the status and at the start, each with its remedy; none where there is nothing to warn of.
  for (const std::string& text : {warnings, daemon.errors()}) {
    EXPECT_EQ(text.find("force thread without real-time scheduling") != std::string::npos, !scheduled)
        << text;
    EXPECT_EQ(text.find("handle thread without real-time scheduling") != std::string::npos, !scheduled)
        << text;
    EXPECT_EQ(text.find("memory not locked") != std::string::npos, !locked) << text;
    EXPECT_EQ(text.find("LimitRTPRIO=") != std::string::npos, !scheduled) << text;
    EXPECT_EQ(text.find("LimitMEMLOCK=infinity") != std::string::npos, !locked) << text;
  }
  const nlohmann::json& handle = status.at("handle");
  EXPECT_EQ(handle.at("wantedThreadPriority"), 79);
  EXPECT_EQ(handle.at("threadPriority"), scheduled ? 79 : 0);
  EXPECT_EQ(daemon.terminate(), test::exitedWith(0));
}

TEST(UnprivilegedDaemon, FeelsTheSceneLikeAPrivilegedOne) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, {"control.engage_at_start=true"}, ordinaryUser(home));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("mode") == "engaged" && test::lengthOf(status.at("tick").at("commandForceNInWorld")) > 1;
  }));
  EXPECT_EQ(daemon.terminate(), test::exitedWith(0));
}

}  // namespace
}  // namespace hapticd
