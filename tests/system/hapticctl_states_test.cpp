// SPDX-License-Identifier: Apache-2.0
// Every command of hapticctl against daemons in every state: its output and exit status.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <sstream>

#include "tests/system/fake_daemon.h"
#include "tests/system/fake_replies.h"
#include "tests/system/hapticctl_home.h"

namespace hapticd::test {
namespace {

using nlohmann::json;
using Command = std::vector<std::string>;

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kNoConnection = 3;

const std::string kPairs =
    "name,camera_x_m,camera_y_m,camera_z_m,world_x_m,world_y_m,world_z_m\n"
    "a,0,0,-1,0,0,-1\nb,0.3,0,-1,0.3,0,-1\nc,0,0.3,-1,0,0.3,-1\n";

const std::string kScene =
    "fixtures: [{name: nerve, kind: sphere, position_m: [0, 0, -1], radius_m: 0.05}]\n"
    "regions: [{name: liver, shape: sphere, position_m: [0, 0, -1], radius_m: 0.05}]\n";

const std::string kTouched = "0 0 -1\n0.1 0 -1\n0.1 0.1 -1\n0 0.1 -1\n";

/// Every command that calls the daemon; PAIRS stands for a file with point pairs, SCENE for one with fixtures
/// and regions, TOUCHED for one with points of a plane.
const std::vector<Command> kCommands{{"status"},
                                     {"status", "--all"},
                                     {"watch", "--count", "1"},
                                     {"events"},
                                     {"metrics"},
                                     {"version"},
                                     {"get"},
                                     {"set", "force.radius_m=0.03"},
                                     {"engage"},
                                     {"disengage"},
                                     {"clear-fault"},
                                     {"reload"},
                                     {"params"},
                                     {"save", "soft"},
                                     {"load", "soft"},
                                     {"profiles"},
                                     {"profiles", "--delete", "soft"},
                                     {"profiles", "--boot", "soft"},
                                     {"profiles", "--no-boot"},
                                     {"fixture", "list"},
                                     {"fixture", "show", "nerve"},
                                     {"fixture", "add", "vein", "--kind", "point", "--position-m", "0,0,-1"},
                                     {"fixture", "change", "nerve", "--radius-m", "0.06"},
                                     {"fixture", "enable", "nerve"},
                                     {"fixture", "disable", "nerve"},
                                     {"fixture", "touch", "wall", "--kind", "plane", "--touched", "TOUCHED"},
                                     {"fixture", "remove", "nerve"},
                                     {"fixture", "export"},
                                     {"fixture", "import", "SCENE"},
                                     {"region", "list"},
                                     {"region", "show", "liver"},
                                     {"region", "add", "nodule", "--stiffness-n-per-m", "800"},
                                     {"region", "change", "liver", "--friction", "0.1"},
                                     {"region", "stiffness", "liver", "400"},
                                     {"region", "remove", "liver"},
                                     {"region", "export"},
                                     {"region", "import", "SCENE"},
                                     {"trace", "start"},
                                     {"trace", "stop"},
                                     {"trace", "dump"},
                                     {"trace", "list"},
                                     {"trace", "delete", "old"},
                                     {"trace", "keep", "old"},
                                     {"trace", "note", "old", "good"},
                                     {"trace", "mark", "begin"},
                                     {"snapshot"},
                                     {"register", "--points", "PAIRS"},
                                     {"register", "--show"},
                                     {"register", "--reset"},
                                     {"calibrate"}};

/// Commands that work without a daemon, on the machine or on files.
const std::set<std::string> kWithoutDaemon{"camera list", "camera test", "completion",   "doctor",
                                           "help",        "trace info",  "trace export", "trace recover",
                                           "trace plot",  "view"};

std::string textOf(const Command& command) {
  std::string text;
  for (const std::string& word : command) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// The expected result of a command in a state.
struct Expected {
  int code = kDone;
  std::string says = {};  ///< part of what it prints on stderr where it fails, else on stdout
};

/// Results that differ from the usual one, by the command's text or its first word.
using Exceptions = std::vector<std::pair<std::string, Expected>>;

Expected expectedOf(const std::string& command, const Expected& usual, const Exceptions& exceptions) {
  for (const auto& [begin, expected] : exceptions) {
    if (command == begin || command.starts_with(begin + " ")) return expected;
  }
  return usual;
}

class HapticctlStates : public testing::Test {
 protected:
  HapticctlStates() {
    home.folder().write("pairs.csv", kPairs);
    home.folder().write("scene.yaml", kScene);
    home.folder().write("touched.txt", kTouched);
  }

  Command withFiles(Command command) const {
    for (std::string& word : command) {
      if (word == "PAIRS") word = (home.path() / "pairs.csv").string();
      if (word == "SCENE") word = (home.path() / "scene.yaml").string();
      if (word == "TOUCHED") word = (home.path() / "touched.txt").string();
    }
    return command;
  }

  /// Runs all commands at the same time, because some wait, and compares.
  void expectOfAll(const Expected& usual, const Exceptions& exceptions = {},
                   const ProgramOptions& options = {}) {
    std::vector<std::unique_ptr<Program>> programs;
    for (const Command& command : kCommands) {
      programs.push_back(std::make_unique<Program>(home.command(withFiles(command)), options));
    }
    for (std::size_t i = 0; i < kCommands.size(); ++i) {
      const std::string command = textOf(kCommands[i]);
      const Expected expected = expectedOf(command, usual, exceptions);
      EXPECT_EQ(programs[i]->wait(), exitedWith(expected.code)) << command << ": " << programs[i]->errors();
      const std::string said = expected.code == kDone ? programs[i]->output() : programs[i]->errors();
      EXPECT_TRUE(has(said, expected.says)) << command << " says: " << said;
      if (expected.code == kDone) {
        EXPECT_EQ(programs[i]->errors(), "") << command;
      } else {
        EXPECT_GE(std::ranges::count(programs[i]->errors(), '\n'), 1) << command;
      }
    }
  }

  HapticctlHome home;
};

/// The subcommands that a help lists.
std::vector<std::string> subcommandsIn(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help.substr(std::min(help.find("Subcommands:"), help.size())));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ") && line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

TEST_F(HapticctlStates, TableNamesEveryCommand) {
  std::set<std::string> listed = kWithoutDaemon;
  for (const Command& command : kCommands) {
    const bool in_group = command[0] == "trace" || command[0] == "fixture" || command[0] == "region";
    listed.insert(in_group ? command[0] + " " + command[1] : command[0]);
  }
  std::set<std::string> known;
  for (const std::string& name : subcommandsIn(home.run({"--help"}).output)) {
    const std::vector<std::string> below = subcommandsIn(home.run({name, "--help"}).output);
    for (const std::string& subcommand : below) known.insert(name + " " + subcommand);
    if (below.empty()) known.insert(name);
  }
  EXPECT_EQ(listed, known);
}

TEST_F(HapticctlStates, AllWorkWhereAllIsWell) {
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  expectOfAll({kDone, ""});
}

TEST_F(HapticctlStates, AllSayThatADaemonIsAbsentAndHowToStartIt) {
  expectOfAll({kNoConnection, "is hapticd running? Start it with 'systemctl start hapticd'"});
}

TEST_F(HapticctlStates, AllSayWhichGroupMayWhenPermissionIsMissing) {
  if (::geteuid() != 0) GTEST_SKIP() << "takes root, to become another user";
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  std::filesystem::permissions(home.path(), std::filesystem::perms(0755));
  ASSERT_EQ(::chmod(home.socket().c_str(), 0660), 0);
  expectOfAll({kNoConnection, "members of the group "}, {}, {.user = 65534});
}

TEST_F(HapticctlStates, AllEndInTimeWhereNobodyAnswersYet) {
  FakeDaemon daemon(home.socket());
  daemon.answer("", FakeAnswer{});
  expectOfAll({kNoConnection, "hapticd may be starting or busy"});
}

TEST_F(HapticctlStates, AllSayThatTheConnectionWasClosed) {
  FakeDaemon daemon(home.socket());
  daemon.answer("", FakeAnswer{.hangs_up = true});
  expectOfAll({kNoConnection, "the connection was closed without an answer"});
}

TEST_F(HapticctlStates, AllSayThatThereAreTooManyConnections) {
  FakeDaemon daemon(home.socket());
  daemon.answer("", FakeAnswer{.error = "io.hapticd.Status.TooManyConnections",
                               .error_parameters = {{"limit", 8}, {"perUser", true}}});
  expectOfAll({kFailed, "hapticd serves 8 of each user at once"});
}

TEST_F(HapticctlStates, ADaemonThatIsStartingShowsItsStateAndRefusesWhatTakesALoop) {
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  const json status = statusWith({{"mode", "starting"}, {"cause", "none"}});
  daemon.answer("io.hapticd.Status.GetStatus", json{{"status", status}});
  daemon.refuse("io.hapticd.Control.Engage", "io.hapticd.Control.NotApplied", {{"generation", 2}});
  daemon.refuse("io.hapticd.Control.Disengage", "io.hapticd.Control.NotApplied", {{"generation", 2}});
  daemon.refuse("io.hapticd.Control.SetParameters", "io.hapticd.Control.NotApplied", {{"generation", 2}});
  daemon.refuse("io.hapticd.Control.LoadProfile", "io.hapticd.Control.NotApplied", {{"generation", 2}});
  const Expected later{kFailed, "it will when it runs again"};
  expectOfAll({kDone, ""}, {{"status", {kDone, "mode          starting"}},
                            {"engage", later},
                            {"disengage", later},
                            {"set", later},
                            {"load", later}});
}

TEST_F(HapticctlStates, AFaultedDaemonSaysHowToClearTheFault) {
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  const json faulted{{"mode", "faulted"}, {"cause", "handle_too_fast"}};
  json status = faulted;
  status["warnings"] = {
      "faulted: the hand seems to move faster than safety.max_handle_speed_m_per_s (correct "
      "the cause, then: hapticctl clear-fault)"};
  daemon.answer("io.hapticd.Status.GetStatus", json{{"status", statusWith(status)}});
  daemon.answer("io.hapticd.Control.Engage", faulted);
  expectOfAll({kDone, ""}, {{"status",
                             {kDone,
                              "! faulted: the hand seems to move faster than "
                              "safety.max_handle_speed_m_per_s"}},
                            {"engage", {kFailed, "not engaged: faulted"}}});
}

TEST_F(HapticctlStates, ClearFaultSaysSoWhereThereIsNone) {
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  daemon.refuse("io.hapticd.Control.ClearFault", "io.hapticd.Control.NotFaulted", json::object());
  const Finished finished = home.run({"clear-fault"});
  EXPECT_EQ(finished.ending, exitedWith(kFailed));
  EXPECT_TRUE(has(finished.errors, "there is no fault to clear")) << finished.errors;
}

TEST_F(HapticctlStates, ADaemonWithoutCameraHasNoSnapshot) {
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  const json camera{{"camera", {{"state", "absent"}, {"detail", "no Kinect on USB: plug one in"}}},
                    {"warnings", {"camera absent: no Kinect on USB: plug one in"}}};
  daemon.answer("io.hapticd.Status.GetStatus", json{{"status", statusWith(camera)}});
  daemon.refuse("io.hapticd.Status.GetSnapshot", "io.hapticd.Status.NoFrame",
                {{"reason", "the camera is absent: plug one in"}});
  expectOfAll({kDone, ""}, {{"status", {kDone, "! camera absent: no Kinect on USB: plug one in"}},
                            {"snapshot", {kFailed, "the camera is absent: plug one in"}}});
}

TEST_F(HapticctlStates, AnOlderDaemonDoesWhatItKnowsAndIsCalledOldForTheRest) {
  FakeDaemon daemon(home.socket());
  answerAsAnOldDaemon(daemon);
  const Expected known{kDone, ""};
  expectOfAll({kFailed, "it is older than hapticctl"},
              {{"status", known},
               {"watch", known},
               {"metrics", known},
               {"version", {kDone, "! hapticd is of another version than hapticctl"}},
               {"get", known},
               {"set", known},
               {"engage", known},
               {"disengage", known},
               {"params", known},
               {"calibrate", {kFailed, "is it of another version than hapticctl?"}}});
}

TEST_F(HapticctlStates, WatchAsksADaemonThatKnowsNoFieldsForAll) {
  FakeDaemon daemon(home.socket());
  daemon.refuse("io.hapticd.Status.Monitor", "org.varlink.service.InvalidParameter",
                {{"parameter", "fields"}});
  const Finished finished = home.run({"watch", "--count", "1"});
  EXPECT_EQ(finished.ending, exitedWith(kFailed));
  std::vector<json> calls = daemon.calls();
  std::erase_if(calls, [](const json& call) { return call["method"] != "io.hapticd.Status.Monitor"; });
  ASSERT_EQ(calls.size(), 2U);
  EXPECT_TRUE(calls[0]["parameters"].contains("fields"));
  EXPECT_FALSE(calls[1]["parameters"].contains("fields"));
}

TEST_F(HapticctlStates, TheStatusSocketLetsOnlyRead) {
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  const Expected denied{kFailed, "members of the group haptic may"};
  for (const char* method :
       {"SetParameters",  "Engage",      "Disengage",      "ClearFault",    "StartTrace",
        "StopTrace",      "DumpTrace",   "DeleteTrace",    "KeepTrace",     "NoteTrace",
        "MarkTrace",      "SaveProfile", "LoadProfile",    "DeleteProfile", "SetBootProfile",
        "SetCalibration", "Reload",      "ChangeFixtures", "ChangeRegions", "SetStiffness"}) {
    daemon.refuse(std::string("io.hapticd.Control.") + method, "org.varlink.service.PermissionDenied",
                  json::object());
  }
  const Expected read{kDone, ""};
  expectOfAll(denied, {{"status", read},
                       {"watch", read},
                       {"events", read},
                       {"metrics", read},
                       {"version", read},
                       {"get", read},
                       {"params", read},
                       {"profiles --delete", denied},
                       {"profiles --boot", denied},
                       {"profiles --no-boot", denied},
                       {"profiles", read},
                       {"fixture list", read},
                       {"fixture show", read},
                       {"fixture export", read},
                       {"region list", read},
                       {"region show", read},
                       {"region export", read},
                       {"trace list", read},
                       {"snapshot", read},
                       {"register --show", read},
                       {"calibrate", read}});
}

TEST_F(HapticctlStates, ReasonsOfTheDaemonAreShownAsTheyAre) {
  FakeDaemon daemon(home.socket());
  answerEverything(daemon);
  daemon.refuse("io.hapticd.Control.StartTrace", "io.hapticd.Control.TraceFailed",
                {{"reason", "the disk is full: free some"}});
  daemon.refuse("io.hapticd.Control.SaveProfile", "io.hapticd.Control.ProfileFailed",
                {{"reason", "no such name"}});
  EXPECT_TRUE(has(home.run({"trace", "start"}).errors, "hapticctl: the disk is full: free some\n"));
  EXPECT_TRUE(has(home.run({"save", "a/b"}).errors, "hapticctl: no such name\n"));
}

TEST_F(HapticctlStates, WithJsonEveryFailureIsAnObjectToo) {
  const Finished absent = home.run({"--json", "status"});
  EXPECT_EQ(json::parse(absent.errors)["error"], "NoConnection");
  FakeDaemon daemon(home.socket());
  EXPECT_EQ(json::parse(home.run({"--json", "profiles"}).errors)["error"],
            "org.varlink.service.MethodNotFound");
  EXPECT_EQ(json::parse(home.run({"--json", "register", "--points", "/nowhere"}).errors)["error"], "Failed");
}

}  // namespace
}  // namespace hapticd::test
