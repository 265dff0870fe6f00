// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using test::contains;
using test::DaemonHome;
using test::exitedWith;

constexpr int kNoConnection = 3;

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
