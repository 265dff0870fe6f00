// SPDX-License-Identifier: Apache-2.0
// Fixtures of a running hapticd, made and changed with hapticctl.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/support/file_content.h"
#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using nlohmann::json;
using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;

class Fixtures : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(daemon.answers()); }

  std::string output(const std::vector<std::string>& arguments) {
    const test::Finished finished = home.control(arguments);
    EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
    return finished.output;
  }
  std::string refusal(const std::vector<std::string>& arguments) {
    const test::Finished finished = home.control(arguments);
    EXPECT_EQ(finished.ending, exitedWith(1)) << finished.output;
    return finished.errors;
  }
  void addNerve() {
    output({"fixture", "add", "nerve", "--kind", "sphere", "--position-m", "0,0,-0.8", "--radius-m", "0.05"});
  }

  const DaemonHome home;
  Daemon daemon{home};
};

TEST_F(Fixtures, AreAddedListedChangedAndRemoved) {
  addNerve();
  output({"fixture", "add", "way", "--kind", "path", "--points-m", "0,0,-0.9 0.1,0,-0.9"});
  EXPECT_EQ(output({"fixture", "list", "--names"}), "nerve\nway\n");
  EXPECT_EQ(output({"fixture", "disable", "nerve", "way"}), "disabled nerve, way\n");
  EXPECT_TRUE(contains(output({"fixture", "list"}), "disabled"));
  output({"fixture", "change", "nerve", "--radius-m", "0.06"});
  EXPECT_EQ(json::parse(output({"--json", "fixture", "show", "nerve"}))["definition"]["radius_m"], 0.06);
  output({"fixture", "enable", "nerve"});
  EXPECT_TRUE(contains(output({"status", "--all"}), "1 of 2 enabled"));
  output({"fixture", "remove", "way"});
  EXPECT_EQ(output({"fixture", "list", "--names"}), "nerve\n");
  EXPECT_TRUE(contains(output({"events", "--kind", "fixture"}), "removes fixture way"));
  EXPECT_TRUE(daemon.ticks());
}

TEST_F(Fixtures, AreExportedForImportAndForTheConfiguration) {
  addNerve();
  const std::string file = home.path() / "scene.yaml";
  output({"fixture", "export", file});
  // without the distance of the HIP, which moves
  const auto definition = [this] {
    return json::parse(output({"--json", "fixture", "show", "nerve"})).at("definition");
  };
  const json before = definition();
  EXPECT_TRUE(contains(refusal({"fixture", "import", file}), "nerve"));
  output({"fixture", "import", file, "--replace"});
  output({"fixture", "remove", "nerve"});
  output({"fixture", "import", file});
  EXPECT_EQ(definition(), before);
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  Daemon configured{home, test::kWallYaml + test::contentOf(file)};
  ASSERT_TRUE(configured.answers());
  EXPECT_EQ(definition(), before);
}

TEST_F(Fixtures, ThatAreBadAreRefusedWithNameFieldAndRemedyAndNothingChanges) {
  addNerve();
  const std::string flat =
      refusal({"fixture", "add", "flat", "--kind", "sphere", "--position-m", "0,0,0", "--radius-m", "0"});
  EXPECT_TRUE(contains(flat, "flat"));
  EXPECT_TRUE(contains(flat, "radius_m"));
  EXPECT_TRUE(contains(refusal({"fixture", "remove", "nervv"}), "did you mean nerve"));
  EXPECT_TRUE(contains(refusal({"fixture", "enable", "nerve", "ghost"}), "ghost"));
  EXPECT_EQ(home.control({"fixture", "change", "nerve", "--radius-m", "wide"}).ending, exitedWith(2));
  EXPECT_EQ(output({"fixture", "list", "--names"}), "nerve\n");
}

TEST_F(Fixtures, SurviveInAProfileAndAReloadOfAConfigurationWithoutThem) {
  addNerve();
  output({"save", "case"});
  output({"fixture", "remove", "nerve"});
  EXPECT_TRUE(contains(output({"load", "case"}), "fixtures"));
  EXPECT_EQ(output({"fixture", "list", "--names"}), "nerve\n");
  output({"reload"});
  EXPECT_TRUE(contains(output({"fixture", "list"}), "profile"));
}

TEST_F(Fixtures, TissueRegionsGetTheirStiffness) {
  output({"region", "add", "liver", "--shape", "sphere", "--position-m", "0,0,-1", "--radius-m", "0.1",
          "--stiffness-n-per-m", "300"});
  output({"region", "stiffness", "liver", "450"});
  EXPECT_TRUE(contains(output({"region", "show", "liver"}), "450"));
  EXPECT_TRUE(contains(refusal({"region", "stiffness", "lung", "450"}), "lung"));
  EXPECT_TRUE(daemon.ticks());
}

}  // namespace
}  // namespace hapticd
