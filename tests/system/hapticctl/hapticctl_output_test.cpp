// SPDX-License-Identifier: Apache-2.0
// The output of hapticctl: on a full disk, in files, and the width of its help.
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/loopback_listener.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

const std::string kFull = "hapticctl: cannot write to standard output: No space left on device\n";

/// Commands that print in each of the ways that there are: a text, JSON, lines as they come, help, a file.
const std::vector<Words> kPrinting{{"status", "--all"},
                                   {"--json", "status"},
                                   {"watch", "--count", "2", "--interval", "20"},
                                   {"--json", "watch", "--count", "2", "--interval", "20"},
                                   {"events"},
                                   {"metrics"},
                                   {"set", "force.radius_m=0.03"},
                                   {"params"},
                                   {"fixture", "export"},
                                   {"get", "force"},
                                   {"trace", "info", "FOLDER/a.mcap"},
                                   {"trace", "export", "FOLDER/a.mcap", "--out", "FOLDER/b.csv"},
                                   {"snapshot"},
                                   {"view", "--port", "PORT", "--token-file", "FOLDER/token"},
                                   {"register", "--show"},
                                   {"camera", "list"},
                                   {"handle", "list"},
                                   {"doctor"},
                                   {"completion", "bash"},
                                   {"help", "trace", "list"},
                                   {"trace", "--help"},
                                   {"--version"}};

class HapticctlOutput : public testing::Test {
 protected:
  HapticctlOutput() {
    writeTrace(home.path() / "a.mcap", madeUpRecords(1, 50), 50);
    home.write("token", std::string(32, 'a') + "\n");
  }

  /// Runs hapticctl with its standard output redirected to `output`.
  Finished runInto(const std::string& output, const Words& arguments) const {
    Words line{"/bin/sh", "-c", "exec \"$@\" >" + output, "sh"};
    for (std::string word : home.controlCommand(arguments)) {
      if (word == "PORT") word = view.port();
      if (word.starts_with("FOLDER")) word.replace(0, 6, home.path().string());
      line.push_back(word);
    }
    return runToEnd(line);
  }

  /// The names that help lists below a command, or below hapticctl itself.
  Words subcommandsOf(Words path) const {
    path.push_back("--help");
    const std::string help = home.control(path).output;
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

  const DaemonHome home;
  LoopbackListener view;
};

TEST_F(HapticctlOutput, ACommandWhoseOutputIsLostFailsWithTheReason) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const nlohmann::json& status) { return status["camera"]["frames"] > 0; }));
  for (const Words& command : kPrinting) {
    const Finished finished = runInto("/dev/full", command);
    EXPECT_EQ(finished.ending, exitedWith(1)) << command[0] << ": " << finished.errors;
    EXPECT_TRUE(finished.errors.ends_with(kFull)) << command[0] << ": " << finished.errors;
  }
}

TEST_F(HapticctlOutput, EveryHelpFitsATerminalOf80ColumnsAndNamesTheExitStatus) {
  std::vector<Words> all = commands();
  all.insert(all.end(), {{}, {"trace"}});
  for (Words command : all) {
    const bool has_own_footer = !command.empty() && (command[0] == "camera" || command[0] == "handle");
    command.push_back("--help");
    const std::string text = home.control(command).output;
    EXPECT_TRUE(has_own_footer || contains(text, "Exit status: 0 done"));
    std::istringstream help(text);
    for (std::string line; std::getline(help, line);) EXPECT_LE(line.size(), 80U) << line;
  }
  EXPECT_TRUE(contains(home.control({"events", "--help"}).output, "of these kinds: mode, camera, handle,"));
}

TEST_F(HapticctlOutput, AReaderThatHasSeenEnoughIsNoError) {
  for (const Words& command : {Words{"completion", "bash"}, {"help", "trace", "list"}, {"--help"}}) {
    Words line{"/bin/sh", "-c", "\"$@\" | true", "sh"};
    for (const std::string& word : home.controlCommand(command)) line.push_back(word);
    const Finished finished = runToEnd(line);
    EXPECT_EQ(finished.ending, exitedWith(0));
    EXPECT_EQ(finished.errors, "") << command[0];
  }
}

TEST_F(HapticctlOutput, AClosedStandardOutputIsSaidAndTakesNoSocketsPlace) {
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
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
        home.control({"trace", plot ? "plot" : "export", (home.path() / "a.mcap").string(), "--out", file},
                     {.largest_file_bytes = 500});
    EXPECT_EQ(finished.ending, exitedWith(1)) << out << ": " << finished.output;
    EXPECT_NE(finished.errors, "");
    EXPECT_FALSE(fs::exists(file)) << out;
  }
  const Finished bag = home.control({"trace", "export", (home.path() / "a.mcap").string(), "--format",
                                     "rosbag2", "--out", (home.path() / "b.mcap").string()},
                                    {.largest_file_bytes = 20'000});
  EXPECT_EQ(bag.ending, exitedWith(1)) << bag.output;
  EXPECT_TRUE(contains(bag.errors, "b.mcap: cannot be written: ")) << bag.errors;
  EXPECT_TRUE(contains(bag.errors, "free space, or name a file on another disk with --out")) << bag.errors;
  EXPECT_EQ(std::distance(fs::directory_iterator(home.path()), {}), before);
}

TEST_F(HapticctlOutput, TheEndingOfAFileDecidesItsFormat) {
  const std::string trace = (home.path() / "a.mcap").string();
  const auto run = [&](Words arguments, const char* name) {
    arguments.push_back((home.path() / name).string());
    return home.control(arguments);
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
    EXPECT_TRUE(contains(refused.errors, said)) << name;
    EXPECT_FALSE(fs::exists(home.path() / name)) << name;
  }
}

TEST_F(HapticctlOutput, ADeviceIsNeverReplacedByAFile) {
  const fs::path link = home.path() / "full.csv";
  fs::create_symlink("/dev/full", link);
  const Finished refused =
      home.control({"trace", "export", (home.path() / "a.mcap").string(), "--out", link.string(), "--force"});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(contains(refused.errors, "is not a file that can be replaced"));
  EXPECT_TRUE(fs::is_symlink(link));
}

}  // namespace
}  // namespace hapticd::test
