// SPDX-License-Identifier: Apache-2.0
#include "daemon/injection/fault_injector.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

base::Result<std::vector<ScriptedFault>> scriptOf(const std::string& text) {
  const test::TemporaryFolder folder;
  return readFaultScript(folder.write("faults", text));
}

TEST(FaultScript, ReadsTimesAndFaultsAndLeavesOutComments) {
  const auto script = scriptOf("# a tour\n\n 1.5 0.25 nan_pose # first\n2 3 frozen_camera\r\n");
  ASSERT_TRUE(script);
  ASSERT_EQ(script->size(), 2U);
  EXPECT_EQ(script->front().fault, Fault::nan_pose);
  EXPECT_EQ(script->front().begin.count(), 1.5);
  EXPECT_EQ(script->front().duration.count(), 0.25);
  EXPECT_EQ(script->back().fault, Fault::frozen_camera);
}

TEST(FaultScript, KnowsEveryFaultByItsName) {
  for (int number = 0; number < kFaultCount; ++number) {
    const auto fault = static_cast<Fault>(number);
    const auto script = scriptOf("0 1 " + std::string(nameOf(fault)));
    ASSERT_TRUE(script) << nameOf(fault);
    EXPECT_EQ(script->front().fault, fault);
  }
}

TEST(FaultScript, NamesTheLineThatIsWrongAndWhatIsAllowed) {
  for (const char* wrong : {"x 1 nan_pose", "1 nan_pose", "-1 1 nan_pose", "1 inf nan_pose", "1 1e9 nan_pose",
                            "1 1 nan_pose twice"}) {
    const auto script = scriptOf(std::string("0 1 nan_pose\n") + wrong + "\n");
    ASSERT_FALSE(script) << wrong;
    EXPECT_TRUE(script.error().where.ends_with("faults:2")) << script.error().text();
    EXPECT_NE(script.error().what.find(wrong), std::string::npos);
  }
  const auto unknown = scriptOf("1 1 earthquake");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().remedy.find("handle_unplugged"), std::string::npos);
  EXPECT_FALSE(readFaultScript("/nonexistent/faults"));
}

TEST(FaultScript, ShowsWhatIsWrongWithoutEscapeCodesAndCut) {
  for (const std::string& wrong :
       {"\x1b[2J" + std::string(3000, 'x'), "1 1 \x1b[2J" + std::string(3000, 'x')}) {
    const auto script = scriptOf(wrong);
    ASSERT_FALSE(script);
    EXPECT_EQ(script.error().text().find('\x1b'), std::string::npos);
    EXPECT_NE(script.error().what.find("\\x1b[2Jxx"), std::string::npos) << script.error().what;
    EXPECT_LT(script.error().what.size(), 200U);
  }
}

}  // namespace
}  // namespace hapticd::daemon
