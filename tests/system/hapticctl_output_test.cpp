// SPDX-License-Identifier: Apache-2.0
// The output of hapticctl: every command on a full disk, and the width of its help.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/system/fake_replies.h"
#include "tests/system/hapticctl_home.h"
#include "tests/system/loopback_listener.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

const std::string kFull = "hapticctl: cannot write to standard output: No space left on device\n";

/// The arguments that each command needs to print something; FOLDER stands for the test's folder.
const std::map<std::string, Words> kArguments{
    {"status", {"--all"}},
    {"watch", {"--count", "2", "--interval", "20"}},
    {"events", {}},
    {"metrics", {}},
    {"version", {}},
    {"get", {}},
    {"set", {"force.radius_m=0.03"}},
    {"engage", {}},
    {"disengage", {}},
    {"clear-fault", {}},
    {"reload", {}},
    {"params", {}},
    {"save", {"soft"}},
    {"load", {"soft"}},
    {"profiles", {}},
    {"fixture list", {}},
    {"fixture show", {"nerve"}},
    {"fixture add", {"vein", "--kind", "point", "--position-m", "0,0,-1"}},
    {"fixture change", {"nerve", "--radius-m", "0.06"}},
    {"fixture enable", {"nerve"}},
    {"fixture disable", {"nerve"}},
    {"fixture touch", {"wall", "--kind", "plane", "--touched", "FOLDER/touched.txt"}},
    {"fixture remove", {"nerve"}},
    {"fixture export", {}},
    {"fixture import", {"FOLDER/scene.yaml"}},
    {"region list", {}},
    {"region show", {"liver"}},
    {"region add", {"nodule", "--stiffness-n-per-m", "800"}},
    {"region change", {"liver", "--friction", "0.1"}},
    {"region stiffness", {"liver", "400"}},
    {"region remove", {"liver"}},
    {"region export", {}},
    {"region import", {"FOLDER/scene.yaml"}},
    {"trace start", {}},
    {"trace stop", {}},
    {"trace dump", {}},
    {"trace list", {}},
    {"trace keep", {"old"}},
    {"trace note", {"old", "good"}},
    {"trace mark", {"begin"}},
    {"trace delete", {"old"}},
    {"trace info", {"FOLDER/a.mcap"}},
    {"trace export", {"FOLDER/a.mcap", "--out", "FOLDER/b.csv"}},
    {"trace recover", {"FOLDER/a.mcap"}},
    {"trace plot", {"FOLDER/a.mcap", "--out", "FOLDER/b.svg"}},
    {"snapshot", {}},
    {"view", {"--port", "PORT", "--token-file", "FOLDER/token"}},
    {"register", {"--show"}},
    {"calibrate", {}},
    {"camera list", {}},
    {"doctor", {}},
    {"completion", {"bash"}},
    {"help", {"trace", "list"}}};

class HapticctlOutput : public testing::Test {
 protected:
  HapticctlOutput() : daemon(home.socket()) {
    answerEverything(daemon);
    writeTrace(home.path() / "a.mcap", madeUpRecords(1, 50), 50);
    home.folder().write("scene.yaml",
                        "fixtures: [{name: nerve, kind: sphere, position_m: [0, 0, -1], radius_m: 0.05}]\n"
                        "regions: [{name: liver, shape: sphere, position_m: [0, 0, -1], radius_m: 0.05}]\n");
    home.folder().write("touched.txt", "0 0 -1\n0.1 0 -1\n0.1 0.1 -1\n0 0.1 -1\n");
    home.folder().write("token", std::string(32, 'a') + "\n");
  }

  /// Runs hapticctl with its standard output redirected to `output`.
  Finished runInto(const std::string& output, const Words& arguments) const {
    Words line{"/bin/sh", "-c", "exec \"$@\" >" + output, "sh"};
    for (std::string word : home.command(arguments)) {
      if (word == "PORT") word = view.port();
      if (word.starts_with("FOLDER")) word.replace(0, 6, home.path().string());
      line.push_back(word);
    }
    return runToEnd(line);
  }

  /// The names that help lists below a command, or below hapticctl itself.
  Words subcommandsOf(Words path) const {
    path.push_back("--help");
    const std::string help = home.run(path).output;
    Words names;
    for (std::size_t at = help.find("Subcommands:"); at != std::string::npos;) {
      at = help.find("\n  ", at);
      if (at == std::string::npos) break;
      at += 3;
      if (help[at] != ' ') names.push_back(help.substr(at, help.find_first_of(" \n", at) - at));
    }
    return names;
  }

  /// Returns all commands except groups.
  std::vector<Words> commands() const {
    std::vector<Words> all;
    for (const std::string& name : subcommandsOf({})) {
      const Words below = subcommandsOf({name});
      if (below.empty()) all.push_back({name});
      for (const std::string& second : below) all.push_back({name, second});
    }
    return all;
  }

  HapticctlHome home;
  FakeDaemon daemon;
  LoopbackListener view;
};

TEST_F(HapticctlOutput, EveryCommandFailsWithTheReasonWhereItsOutputIsLost) {
  const std::vector<Words> all = commands();
  ASSERT_GT(all.size(), 25U);
  for (const Words& command : all) {
    const std::string name = command.size() == 1 ? command[0] : command[0] + " " + command[1];
    if (name == "camera test") continue;  // it prints nothing without a camera
    const auto arguments = kArguments.find(name);
    ASSERT_NE(arguments, kArguments.end()) << "give the test what " << name << " needs";
    for (const bool as_json : {false, true}) {
      Words line = command;
      line.insert(line.end(), arguments->second.begin(), arguments->second.end());
      if (as_json) line.insert(line.begin(), "--json");
      for (const char* made : {"b.csv", "b.settings.yaml", "b.svg"}) fs::remove(home.path() / made);
      const Finished finished = runInto("/dev/full", line);
      EXPECT_EQ(finished.ending, exitedWith(1)) << name << (as_json ? " --json: " : ": ") << finished.errors;
      EXPECT_TRUE(finished.errors.ends_with(kFull)) << name << ": " << finished.errors;
    }
    Words help = command;
    help.push_back("--help");
    EXPECT_EQ(runInto("/dev/full", help).errors, kFull) << name;
  }
}

TEST_F(HapticctlOutput, EveryHelpFitsATerminalOf80Columns) {
  std::vector<Words> all = commands();
  all.insert(all.end(), {{}, {"trace"}});
  for (Words command : all) {
    command.push_back("--help");
    std::istringstream help(home.run(command).output);
    for (std::string line; std::getline(help, line);) EXPECT_LE(line.size(), 80U) << line;
  }
  EXPECT_TRUE(has(home.run({"events", "--help"}).output, "of these kinds: mode, camera, handle,"));
}

TEST_F(HapticctlOutput, AReaderThatHasSeenEnoughIsNoError) {
  for (const Words& command : {Words{"completion", "bash"}, {"watch", "--interval", "20"}, {"params"}}) {
    Words line{"/bin/sh", "-c", "\"$@\" | true", "sh"};
    for (const std::string& word : home.command(command)) line.push_back(word);
    const Finished finished = runToEnd(line);
    EXPECT_EQ(finished.ending, exitedWith(0));
    EXPECT_EQ(finished.errors, "") << command[0];
  }
}

TEST_F(HapticctlOutput, AClosedStandardOutputIsSaidAndTakesNoSocketsPlace) {
  const Finished finished = runInto("&-", {"status"});
  EXPECT_EQ(finished.ending, exitedWith(1));
  EXPECT_EQ(finished.errors, "hapticctl: cannot write to standard output: Bad file descriptor\n");
}

TEST_F(HapticctlOutput, AnErrorThatCannotBeSaidIsStillAnExitStatus) {
  const Finished finished = runInto("/dev/null 2> /dev/full", {"get", "--socket", "/nowhere"});
  EXPECT_NE(finished.ending, exitedWith(0));
  EXPECT_TRUE(finished.ending.exited);
}

TEST_F(HapticctlOutput, OnAFullDiskNothingIsLeftOfAFile) {
  const auto before = std::distance(fs::directory_iterator(home.path()), {});
  for (const char* out : {"b.csv", "b.svg", "b.png"}) {
    const bool plot = std::string(out) == "b.svg" || std::string(out) == "b.png";
    const std::string file = (home.path() / out).string();
    const Finished finished =
        home.run({"trace", plot ? "plot" : "export", (home.path() / "a.mcap").string(), "--out", file},
                 {.largest_file_bytes = 500});
    EXPECT_EQ(finished.ending, exitedWith(1)) << out << ": " << finished.output;
    EXPECT_NE(finished.errors, "");
    EXPECT_FALSE(fs::exists(file)) << out;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(home.path()), {}), before);
}

TEST_F(HapticctlOutput, TheEndingOfAFileDecidesItsFormat) {
  const std::string trace = (home.path() / "a.mcap").string();
  const auto run = [&](Words arguments, const char* name) {
    arguments.push_back((home.path() / name).string());
    return home.run(arguments);
  };
  const Words to_export{"trace", "export", trace, "--out"};
  EXPECT_EQ(run(to_export, "C.CSV").ending, exitedWith(0));
  EXPECT_TRUE(contentOf(home.path() / "C.CSV").starts_with("time_s,"));
  for (const auto& [arguments, name, said] : std::vector<std::tuple<Words, const char*, const char*>>{
           {to_export, "x.h5", "end the name in .csv; HDF5 is made by hdf5_from_trace.py"},
           {to_export, "noending", "end the name in .csv"},
           {{"trace", "plot", trace, "--out"}, "x.jpg", ".png or .svg"},
           {{"snapshot", "--png"}, "x.jpg", ".png"},
           {{"snapshot", "--ply"}, "x.obj", ".ply"}}) {
    const Finished refused = run(arguments, name);
    EXPECT_NE(refused.ending, exitedWith(0)) << name;
    EXPECT_TRUE(has(refused.errors, said)) << name << ": " << refused.errors;
    EXPECT_FALSE(fs::exists(home.path() / name)) << name;
  }
}

TEST_F(HapticctlOutput, ADeviceIsNeverReplacedByAFile) {
  const fs::path link = home.path() / "full.csv";
  fs::create_symlink("/dev/full", link);
  const Finished refused =
      home.run({"trace", "export", (home.path() / "a.mcap").string(), "--out", link.string(), "--force"});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(has(refused.errors, "is not a file that can be replaced")) << refused.errors;
  EXPECT_TRUE(fs::is_symlink(link));
}

TEST_F(HapticctlOutput, TheStatusIsNotCutWhereNoTerminalShowsIt) {
  const std::string identity(150, 'x');
  daemon.answer("io.hapticd.Status.GetStatus",
                nlohmann::json{{"status", statusWith({{"camera", {{"identity", identity}}}})}});
  EXPECT_TRUE(has(home.run({"status"}).output, identity));
}

TEST_F(HapticctlOutput, TheStatusShowsWhatTheCameraReportsOfItself) {
  EXPECT_FALSE(has(home.run({"status", "--all"}).output, "/dev/video"));
  const nlohmann::json details{{"node", "/dev/video2"}, {"serial", ""},        {"firmware", "5.15.1.0"},
                               {"format", "Z16"},       {"widthPx", 848},      {"heightPx", 480},
                               {"rateHz", 30.0},        {"temperatureC", 41.5}};
  daemon.answer("io.hapticd.Status.GetStatus",
                nlohmann::json{{"status", statusWith({{"camera", {{"details", details}}}})}});
  EXPECT_TRUE(has(home.run({"status", "--all"}).output,
                  "/dev/video2, Z16 848 x 480 at 30 Hz, firmware 5.15.1.0, 42 degrees Celsius\n"));
}

}  // namespace
}  // namespace hapticd::test
