// SPDX-License-Identifier: Apache-2.0
// Fixtures of a running hapticd, made and changed with hapticctl.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/system/support/daemon_under_test.h"
#include "tests/unit/tools/solids/made_up_solids.h"

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

  const DaemonHome home;
  Daemon daemon{home};
};

TEST_F(Fixtures, TakeTheirShapeFromAMesh) {
  std::string name;  // longer than the file of a solid can hold, and cut within a character
  for (int i = 0; i < 40; ++i) name += "ä";
  const std::string file = home.path() / ("a" + name + ".stl");
  constexpr rt::Vec3 kCentre_m{0.1, 0, 0};
  std::ofstream(file) << test::binaryStl(test::sphereBody(kCentre_m, 0.02).mesh, "SPACE=LPS");
  const std::vector<std::string> add{"--json", "fixture", "add", "organ", "--mesh", file};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = add;
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  const json checked = json::parse(output(with({"--check", "--tolerance", "0.2mm"})));
  EXPECT_LE(checked.at("errorM"), 0.0002);
  EXPECT_GT(checked.at("errorM"), 0);
  EXPECT_EQ(output({"fixture", "list", "--names"}), "");
  EXPECT_TRUE(contains(refusal(add), "--centre-m"));
  EXPECT_TRUE(contains(refusal(with({"--centre-m", "0,0,-0.8", "--position-m", "0,0,0"})), "given twice"));
  output(with({"--centre-m", "0,0,-0.8"}));
  const json shown = json::parse(output({"--json", "fixture", "show", "organ"}));
  EXPECT_EQ(shown.at("definition").at("kind"), "solid");
  EXPECT_NEAR(shown.at("definition").at("position_m").at(0), -kCentre_m.x, 1e-4);
  EXPECT_TRUE(shown.at("distanceM").is_number()) << shown;

  for (const std::vector<std::string>& option : {std::vector<std::string>{"--check"},
                                                 {"--tolerance", "1mm"},
                                                 {"--axes", "RAS"},
                                                 {"--centre-m", "0,0,0"},
                                                 {"--landmarks", file}}) {
    std::vector<std::string> arguments{"fixture", "add", "ball", "--kind", "sphere", "--radius-m", "0.01"};
    arguments.insert(arguments.end(), option.begin(), option.end());
    const test::Finished finished = home.control(arguments);
    EXPECT_EQ(finished.ending, exitedWith(2));
    EXPECT_TRUE(contains(finished.errors, option.front() + " needs --mesh or --labels")) << finished.errors;
  }
  EXPECT_EQ(output({"fixture", "list", "--names"}), "organ\n");
}

TEST_F(Fixtures, NoneOfThemIsSaidToExertAForceWhileTheBoxIsIdle) {
  // everywhere: the HIP is inside
  output({"fixture", "add", "all", "--kind", "sphere", "--position-m", "0,0,-1", "--radius-m", "5"});
  output({"disengage"});
  ASSERT_TRUE(daemon.reaches([](const json& status) {
    const json& each = status["fixtures"]["each"];
    return status["mode"] == "idle" && status["tick"]["gain"] == 0 && !each.empty() &&
           each[0]["distanceM"].is_number();
  }));
  const json fixtures = daemon.status()["fixtures"];
  EXPECT_LT(fixtures["each"][0]["distanceM"], -4);
  EXPECT_EQ(fixtures["each"][0]["forceN"], 0);
  EXPECT_EQ(fixtures["forceN"], 0);
  EXPECT_TRUE(fixtures["inContact"].empty());
  EXPECT_FALSE(contains(output({"status", "--all"}), "in contact: all"));
  EXPECT_FALSE(contains(output({"fixture", "list"}), "in contact"));
}

TEST_F(Fixtures, OfGuidanceShowTheStiffnessInEffectBesideTheConfiguredOne) {
  output({"set", "force.stiffness_n_per_m=300"});
  output(
      {"fixture", "add", "aim", "--kind", "point", "--position-m", "0,0,-0.9", "--stiffness-n-per-m", "250"});
  const auto entry = [this] { return json::parse(output({"--json", "fixture", "show", "aim"})); };
  ASSERT_TRUE(test::becomesTrue([&] {
    return std::abs(entry()["stiffnessNPerM"].get<double>() - 100) < 0.1;
  })) << entry()
      << "a third of force.stiffness_n_per_m";
  EXPECT_EQ(entry()["definition"]["stiffness_n_per_m"], 250);
  EXPECT_TRUE(contains(output({"fixture", "list"}), "100 of 250 N/m"));
  EXPECT_GT(entry()["distanceM"], 0.01) << "guidance has a distance, too";
}

/// The hand strokes along x, and the half of the strokes at x < 0 is forbidden, by a spring too soft to
/// matter.
TEST(FixtureBreaches, AreEventsWithPlaceDurationDepthSpeedAndForce) {
  const DaemonHome home;
  const std::string strokes =
      std::string(test::kWallYaml) +
      "fixtures: [{name: half, kind: plane, position_m: [0, 0, 0], normal: [1, 0, 0], stiffness_n_per_m: 1, "
      "max_force_n: 0.05}]\n";
  Daemon daemon(home, strokes,
                {"simulated_handle.stroke_m=0.03", "simulated_handle.stroke_period_s=3",
                 "simulated_handle.press_s=600", "control.engage_at_start=true"});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) {
    const json& each = status["fixtures"]["each"];
    return !each.empty() && each[0]["breaches"] >= 2;
  }));
  const auto events = [&home] {
    std::vector<json> all;
    std::istringstream lines(home.control({"--json", "events", "--kind", "breach", "-n", "2"}).output);
    for (std::string line; std::getline(lines, line);)
      all.push_back(json::parse(line, nullptr, false).value("event", json()));
    return all;
  };
  ASSERT_TRUE(test::becomesTrue([&] { return events().size() == 2; }));
  for (const json& event : events()) {
    const json fields = event.value("fields", json::object());
    EXPECT_EQ(fields.value("fixture", ""), "half") << event;
    const auto numberOf = [&fields](const char* name) { return std::stod(fields.value(name, "nan")); };
    EXPECT_GT(numberOf("depth_m"), 1e-3) << event;
    EXPECT_LT(numberOf("depth_m"), 0.04) << "the stroke " << event;
    EXPECT_GT(numberOf("duration_s"), 0.1) << event;
    EXPECT_GT(numberOf("entered_age_s"), 0.49 + numberOf("duration_s"))
        << "outside for half a second " << event;
    EXPECT_GT(numberOf("entry_speed_m_per_s"), 0) << event;
    EXPECT_GE(numberOf("speed_m_per_s"), numberOf("entry_speed_m_per_s")) << event;
    EXPECT_GT(numberOf("force_n"), 0) << event;
    EXPECT_LE(numberOf("force_n"), 0.0505) << "max_force_n, and a digit of the text " << event;
    EXPECT_NEAR(numberOf("entered_m"), 0, 0.02) << "its first number, x: at the boundary " << event;
  }
}

TEST(FixturesWithoutCamera, GoOnOrEndAsEachSays) {
  const DaemonHome home;
  std::vector<std::string> command = home.command(
      std::string(test::kWallYaml) +
          "fixtures: [{name: all, kind: sphere, position_m: [0, 0, -1], radius_m: 5}]\n",
      {"control.engage_at_start=true", "control.allow_fault_injection=true", "safety.depth_timeout_s=0.5"});
  const std::string script = home.path() / "faults";
  std::ofstream(script) << "2 600 frozen_camera\n";
  command.insert(command.end(), {"--inject", script});
  Daemon daemon(home, command);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) {
    return status["mode"] == "engaged" && status["cause"] == "depth_stale" &&
           status["tick"]["depthShare"] == 0;
  }));
  EXPECT_GT(daemon.status()["fixtures"]["each"][0]["forceN"], 0);
  EXPECT_TRUE(contains(home.control({"status"}).output,
                       "engaged: the camera is lost: only the fixtures act that go on without depth"));
  EXPECT_EQ(home.control({"fixture", "change", "all", "--on-camera-loss", "fade"}).ending, exitedWith(0));
  EXPECT_TRUE(daemon.reaches([](const json& status) {
    return status["mode"] == "holding" && status["cause"] == "depth_stale" && status["tick"]["gain"] == 0;
  }));
  EXPECT_TRUE(contains(home.control({"status"}).output, "holding: the newest depth frame is too old"));
}

}  // namespace
}  // namespace hapticd
