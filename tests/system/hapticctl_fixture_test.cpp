// SPDX-License-Identifier: Apache-2.0
// Fixtures by touch and of a model, against a fake daemon.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/file_content.h"
#include "tests/system/fake_daemon.h"
#include "tests/system/fake_replies.h"
#include "tests/system/hapticctl_home.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

class HapticctlFixture : public testing::Test {
 protected:
  HapticctlFixture() : daemon(home.socket()) { answerEverything(daemon); }

  std::string write(const std::string& name, const std::string& content) const {
    return home.folder().write(name, content).string();
  }
  json sent() const { return daemon.newestCall("io.hapticd.Control.ChangeFixtures"); }
  /// The handle rests for a touch at each of these places.
  void touchAt(const std::vector<std::vector<double>>& places) {
    FakeAnswer readings{.in_turn = true};
    for (const auto& place : places) {
      for (int i = 0; i < 20; ++i) readings.replies.push_back(statusAt(place[0], place[1], place[2], 0));
    }
    daemon.answer("io.hapticd.Status.GetStatus", readings);
  }
  static json statusAt(double x, double y, double z, int buttons) {
    return {
        {"status",
         statusWith({{"tick", {{"hipMInWorld", {{"x", x}, {"y", y}, {"z", z}}}, {"buttons", buttons}}}})}};
  }

  HapticctlHome home;
  FakeDaemon daemon;
};

const std::string kModel =
    "fixtures:\n"
    "  - {name: bone, kind: box, position_m: [0.1, 0, 0], size_m: [0.02, 0.04, 0.06]}\n"
    "  - {name: entry, kind: plane, position_m: [0, 0, 0], normal: [1, 0, 0]}\n"
    "landmarks:\n"
    "  - {name: tip, position_m: [0, 0, 0]}\n"
    "  - {name: left, position_m: [0.1, 0, 0]}\n"
    "  - {name: top, position_m: [0, 0.1, 0]}\n";

/// The model a quarter turn about z, 1 m before the camera; `off_m`: of the last landmark along z.
std::string measured(double off_m) {
  return "landmarks:\n  - {name: tip, position_m: [0, 0, -1]}\n  - {name: left, position_m: [0, 0.1, -1]}\n"
         "  - {name: top, position_m: [-0.1, 0, " +
         std::to_string(-1 + off_m) + "]}\n";
}

TEST_F(HapticctlFixture, AModelIsMovedToTheWorldInOneCall) {
  const std::string model = write("model.yaml", kModel);
  const Finished finished = home.run(
      {"fixture", "import", model, "--landmarks", model, "--measured", write("m.yaml", measured(0))});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(has(finished.output, "expected error at the centre")) << finished.output;
  EXPECT_TRUE(has(finished.output, "imported 2 fixtures")) << finished.output;
  const json added = sent()["add"];
  ASSERT_EQ(added.size(), 2U);
  EXPECT_NEAR(added[0]["position_m"][1].get<double>(), 0.1, 1e-9);
  EXPECT_NEAR(added[0]["position_m"][2].get<double>(), -1, 1e-9);
  EXPECT_NEAR(added[0]["rotation_deg"][2].get<double>(), 90, 1e-6);
  EXPECT_NEAR(added[1]["normal"][1].get<double>(), 1, 1e-9);
}

TEST_F(HapticctlFixture, AModelWithALandmarkThatIsOffIsRefused) {
  const std::string model = write("model.yaml", kModel);
  const std::string off = write("off.yaml",
                                "landmarks:\n  - {name: tip, position_m: [0, 0, -1]}\n"
                                "  - {name: left, position_m: [0, 0.13, -1]}\n"
                                "  - {name: top, position_m: [-0.1, 0, -1]}\n");
  const Finished refused = home.run({"fixture", "import", model, "--landmarks", model, "--measured", off});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(has(refused.errors, "nothing was changed: a landmark is off by ")) << refused.errors;
  EXPECT_TRUE(sent().is_null());
  EXPECT_EQ(home.run({"fixture", "import", model}).ending, exitedWith(1)) << "it is not in the world's frame";
  EXPECT_TRUE(sent().is_null());
  EXPECT_EQ(home.run({"fixture", "import", model, "--landmarks", model, "--measured", off,
                      "--most-residual-m", "0.03"})
                .ending,
            exitedWith(0));
}

TEST_F(HapticctlFixture, TheLandmarksOfAModelAreTouchedAndKept) {
  const std::string model = write("model.yaml", kModel);
  const std::string kept = (home.path() / "kept.yaml").string();
  touchAt({{0, 0, -1}, {0, 0.1, -1}, {-0.1, 0, -1}});
  const Finished finished = home.runWithInput(
      "\n\n\n", {"fixture", "import", model, "--landmarks", model, "--save-measured", kept});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(has(finished.errors, "touch 'left' with the handle")) << finished.errors;
  EXPECT_EQ(sent()["add"].size(), 2U);
  EXPECT_TRUE(has(contentOf(kept), "name: \"top\"") || has(contentOf(kept), "name: 'top'") ||
              has(contentOf(kept), "name: top"))
      << contentOf(kept);
}

TEST_F(HapticctlFixture, APlaneIsTouched) {
  touchAt({{0, 0, -1}, {0.1, 0, -1}, {0, 0.1, -1}});
  const Finished finished = home.runWithInput("\n\n\n", {"fixture", "touch", "wall", "--kind", "plane",
                                                         "--points", "3", "--stiffness-n-per-m", "400"});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  const json added = sent()["add"][0];
  EXPECT_EQ(added["name"], "wall");
  EXPECT_NEAR(added["normal"][2].get<double>(), 1, 1e-9) << "towards the camera at the origin";
  EXPECT_EQ(added["stiffness_n_per_m"], 400);
  EXPECT_TRUE(has(finished.output, "root mean square")) << finished.output;
}

TEST_F(HapticctlFixture, APathIsStrokedWhileAButtonIsHeld) {
  FakeAnswer readings{.in_turn = true};
  readings.replies.push_back(statusAt(0.5, 0.5, -1, 0));
  for (int i = 0; i <= 10; ++i) readings.replies.push_back(statusAt(0.01 * i, 0, -1, 2));
  for (int i = 1; i <= 10; ++i) readings.replies.push_back(statusAt(0.1, 0.01 * i, -1, 2));
  readings.replies.push_back(statusAt(0.5, 0.5, -1, 0));
  daemon.answer("io.hapticd.Status.GetStatus", readings);
  const Finished finished = home.runWithInput("\n", {"fixture", "touch", "cut", "--kind", "path"});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  const json points = sent()["add"][0]["points_m"];
  ASSERT_EQ(points.size(), 3U) << points;
  EXPECT_NEAR(points[1][0].get<double>(), 0.1, 0.001);
  EXPECT_TRUE(has(finished.output, "simplified within 1.00 mm")) << finished.output;
}

TEST_F(HapticctlFixture, ABoxAndASphereAreFittedToAFileOfPoints) {
  const std::string box = write("box", "0.1 0 -1\n0 0 -1\n0 0.2 -1\n0.05 0.05 -1.05\n");
  ASSERT_EQ(home.run({"fixture", "touch", "a", "--kind", "box", "--touched", box}).ending, exitedWith(0));
  EXPECT_NEAR(sent()["add"][0]["position_m"][2].get<double>(), -1.025, 1e-9);
  const std::string ball = write("ball", "0.1 0 -1\n-0.1 0 -1\n0 0.1 -1\n0 0 -0.9\n");
  ASSERT_EQ(home.run({"fixture", "touch", "b", "--kind", "sphere", "--touched", ball}).ending, exitedWith(0));
  EXPECT_NEAR(sent()["add"][0]["radius_m"].get<double>(), 0.1, 1e-9);
}

TEST_F(HapticctlFixture, ATouchThatIsRefusedChangesNothing) {
  const std::string line = write("line", "0 0 -1\n0.1 0 -1\n0.2 0 -1\n");
  const std::string bumpy = write("bumpy", "0 0 -1\n0.1 0 -1\n0.1 0.1 -1.03\n0 0.1 -1\n");
  const std::string good = write("good", "0 0 -1\n0.1 0 -1\n0 0.1 -1\n");
  const auto refusal = [&](std::vector<std::string> words, const std::string& input = "") {
    words.insert(words.begin(), {"fixture", "touch"});
    const Finished refused = home.runWithInput(input, words);
    EXPECT_EQ(refused.ending, exitedWith(1)) << words[2];
    return refused.errors;
  };
  EXPECT_TRUE(has(refusal({"wall", "--kind", "plane", "--touched", line}), "lie on a line"));
  EXPECT_TRUE(has(refusal({"wall", "--kind", "plane", "--touched", bumpy}), "a point is off by "));
  EXPECT_TRUE(has(refusal({"wall", "--kind", "plane"}, "q\n"), "given up, nothing was changed"));
  EXPECT_TRUE(
      has(refusal({"nerve", "--kind", "plane", "--touched", good}), "there is a fixture of this name"));
  const std::string escaping =
      refusal({"wall", "--kind", "plane", "--touched", good, "--escape-force-n", "1"});
  EXPECT_TRUE(has(escaping, "escape_force_n")) << escaping;
  EXPECT_TRUE(sent().is_null());
  EXPECT_EQ(home.run({"fixture", "touch", "nerve", "--kind", "plane", "--touched", good, "--replace"}).ending,
            exitedWith(0));
  EXPECT_EQ(sent()["remove"], json({"nerve"}));
}

TEST_F(HapticctlFixture, TouchTakesTheKindsThatCanBeTouched) {
  EXPECT_EQ(home.run({"fixture", "touch", "a", "--kind", "cone"}).ending, exitedWith(2));
  EXPECT_EQ(home.run({"fixture", "touch", "a", "--kind", "box", "--points", "5"}).ending, exitedWith(2));
}

}  // namespace
}  // namespace hapticd::test
