#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using test::contains;
using test::DaemonHome;
using test::exitedWith;

constexpr int kNoConnection = 3;

TEST(HapticctlWithoutDaemon, SaysForEveryCommandThatNothingListensAndExitsWith3) {
  const DaemonHome home;
  const std::vector<std::vector<std::string>> commands{
      {"status"}, {"watch"}, {"get"}, {"set", "force.radius_m=0.03"}, {"engage"}, {"disengage"}, {"params"}};
  for (const std::vector<std::string>& command : commands) {
    const test::Finished finished = home.control(command);
    EXPECT_EQ(finished.ending, exitedWith(kNoConnection)) << command.front();
    EXPECT_TRUE(contains(finished.errors, home.controlSocket())) << command.front();
    EXPECT_EQ(finished.output, "") << command.front();
  }
}

TEST(HapticctlWithoutDaemon, SaysSoToProgramsTooAndExitsWith3) {
  const DaemonHome home;
  const test::Finished finished = home.control({"--json", "status"});
  EXPECT_EQ(finished.ending, exitedWith(kNoConnection));
  EXPECT_NE(finished.errors, "");
  EXPECT_EQ(finished.output, "");
}

TEST(HapticctlWithoutDaemon, ExitsWith3WhereADaemonHasBeenKilled) {
  const DaemonHome home;
  test::Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  daemon.signal(SIGKILL);
  daemon.wait();
  const test::Finished finished = home.control({"status"});
  EXPECT_EQ(finished.ending, exitedWith(kNoConnection));
  EXPECT_TRUE(contains(finished.errors, home.controlSocket()));
}

}  // namespace
}  // namespace hapticd
