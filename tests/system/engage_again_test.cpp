// SPDX-License-Identifier: Apache-2.0
// Requesting force that already acts.

#include <gtest/gtest.h>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

TEST(EngageAgain, InContactKeepsModeAndForce) {
  const test::DaemonHome home;
  test::Daemon daemon(home, test::kWallYaml, {"safety.engage_inside=false"});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches(
      [](const nlohmann::json& status) { return test::lengthOf(status["tick"]["lawForceNInWorld"]) > 0.1; }));
  EXPECT_EQ(home.control({"engage"}).ending, test::exitedWith(1));  // inside the surface
  EXPECT_EQ(home.control({"engage", "--inside"}).ending, test::exitedWith(0));
  const auto isFelt = [](const nlohmann::json& status) {
    return status["mode"] == "engaged" && test::lengthOf(status["tick"]["commandForceNInWorld"]) > 0.1;
  };
  ASSERT_TRUE(daemon.reaches(isFelt));

  const test::Finished again = home.control({"engage"});
  EXPECT_EQ(again.ending, test::exitedWith(0)) << again.errors;
  EXPECT_TRUE(test::contains(again.output, "nothing has changed"));
  EXPECT_TRUE(daemon.reaches(isFelt));
  EXPECT_EQ(daemon.status()["loop"]["transitions"]["byCause"]["inside_surface"], 1);  // of the first request
  EXPECT_EQ(daemon.terminate(), test::exitedWith(0)) << daemon.errors();
}

}  // namespace
}  // namespace hapticd
