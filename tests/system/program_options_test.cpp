// SPDX-License-Identifier: Apache-2.0
// Every program: numeric options take numbers within their range only, and output that is lost is an error.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

using Words = std::vector<std::string>;

/// A program and its exit status for wrong usage.
struct Subject {
  const char* name;
  const char* path;
  int usage_status;
};
const std::vector<Subject> kPrograms{{"hapticd", HAPTICD_PROGRAM, 64},
                                     {"hapticctl", HAPTICCTL_PROGRAM, 2},
                                     {"hapticd-view", HAPTICD_VIEW_PROGRAM, 64},
#ifdef HAPTICD_ROS_PROGRAM
                                     {"hapticd-ros", HAPTICD_ROS_PROGRAM, 64},
                                     {"haptic-crtk-bridge", HAPTIC_CRTK_BRIDGE_PROGRAM, 64},
#endif
                                     {"haptic-bridge", HAPTIC_BRIDGE_PROGRAM, 64},
                                     {"haptic-palpate", HAPTIC_PALPATE_PROGRAM, 64},
                                     {"haptic-replay", HAPTIC_REPLAY_PROGRAM, 64},
                                     {"hapticbench", HAPTICBENCH_PROGRAM, 64}};

/// The words in help that stand for values other than numbers: text.
const std::set<std::string> kTexts{"ADDRESS:PORT", "AGE",        "CHANNEL",    "CMD",        "CONVENTION",
                                   "CSV",          "DEVICE",     "DIR_OR_PGM", "FIELD ...",  "FILE",
                                   "FILE ...",     "FOLDER",     "FORMAT",     "KIND ...",   "LABEL",
                                   "DIR",          "NAME",       "NAME ...",   "ORIGIN ...", "NAME=VALUE ...",
                                   "TOPIC ...",    "NAME=VALUE", "PATH",       "POINTS",     "PROFILE",
                                   "TEXT",         "TEXT ...",   "TIME",       "K/N",        "X,Y,Z",
                                   "X,Y,Z,W",      "LENGTH"};

struct Option {
  std::string name;
  std::string takes;
};

/// The options that help shows, of those that take something.
std::vector<Option> optionsIn(const std::string& help) {
  static const std::regex line(R"(\n  (?:-\w,)?(--[\w-]+) ([^\n]*))");
  std::vector<Option> options;
  for (std::sregex_iterator found(help.begin(), help.end(), line), end; found != end; ++found) {
    std::string takes = (*found)[2];
    takes = " " + takes.substr(0, takes.find("  "));
    for (const std::string_view rest : {" REQUIRED", " Excludes:", " Needs:"}) {
      takes = takes.substr(0, takes.find(rest));
    }
    takes.erase(0, takes.find_first_not_of(' '));
    if (!takes.empty()) options.push_back({(*found)[1], takes});
  }
  return options;
}

Words subcommandsIn(const std::string& help) {
  static const std::regex line(R"(\n  ([a-z][\w-]*) )");
  Words names;
  const std::size_t begin = help.find("\nSubcommands:");
  if (begin == std::string::npos) return names;
  const std::string list = help.substr(begin);
  for (std::sregex_iterator found(list.begin(), list.end(), line), end; found != end; ++found) {
    names.push_back((*found)[1]);
  }
  return names;
}

/// Calls `visit(line, help)` for the program and each of its subcommands.
template <typename Visit>
void visitCommands(const Words& line, const Visit& visit) {
  Words asking = line;
  asking.push_back("--help");
  const Finished help = runToEnd(asking);
  ASSERT_EQ(help.ending, exitedWith(0)) << help.errors;
  visit(line, help.output);
  for (const std::string& name : subcommandsIn(help.output)) {
    Words below = line;
    below.push_back(name);
    visitCommands(below, visit);
  }
}

bool isWords(const std::string& takes) {
  return takes.find('{') != std::string::npos;
}

// Any three in a row have one that a parser may take for a number, but that is none or not finite.
constexpr std::array kNoNumbers{"nan", "", "inf", "-nan", "5x", "-inf", "NAN", "0x10", "1e400", "-1e400"};

TEST(ProgramOptions, NumericOptionsTakeNumbersWithinTheirRangeOnly) {
  int options = 0;
  std::size_t word = 0;
  for (const Subject& program : kPrograms) {
    visitCommands({program.path}, [&](const Words& line, const std::string& help) {
      for (const Option& option : optionsIn(help)) {
        if (isWords(option.takes) || kTexts.contains(option.takes)) continue;
        ASSERT_NE(option.takes.find(" in ["), std::string::npos)
            << program.name << " " << option.name << " takes " << option.takes
            << ": give a number a range with within(), or add the word to this test's texts";
        ++options;
        const std::string first = option.takes.find(" x 3") != std::string::npos ? "0,0," : "";
        // a run takes long, so that each option gets three of the words, and the next one the next three
        for (int i = 0; i < 3; ++i) {
          const char* const bad = kNoNumbers[word++ % kNoNumbers.size()];
          Words wrong = line;
          wrong.push_back(option.name + "=" + first + bad);
          const Finished refused = runToEnd(wrong);
          EXPECT_EQ(refused.ending, exitedWith(program.usage_status)) << program.name << " " << wrong.back();
          EXPECT_NE(refused.errors.find(option.name), std::string::npos)
              << program.name << " " << wrong.back() << ": " << refused.errors;
        }
      }
    });
  }
  EXPECT_GT(options, 30);
}

TEST(ProgramOptions, EveryProgramSaysItsVersionAndReportsWrongUsageInTheSameForm) {
  for (const Subject& program : kPrograms) {
    const Finished version = runToEnd({program.path, "-V"});
    EXPECT_EQ(version.ending, exitedWith(0)) << program.name;
    EXPECT_TRUE(version.output.starts_with(std::string(program.name) + " ")) << version.output;
    EXPECT_EQ(version.output, runToEnd({program.path, "--version"}).output) << program.name;
    const Finished wrong = runToEnd({program.path, "--no-such-option"});
    EXPECT_EQ(wrong.ending, exitedWith(program.usage_status)) << program.name;
    const std::string name = program.name;
    EXPECT_TRUE(wrong.errors.starts_with(name + ": ")) << wrong.errors;
    EXPECT_TRUE(wrong.errors.ends_with("\nRun '" + name + " --help' for more information.\n"))
        << wrong.errors;
  }
}

TEST(ProgramOptions, HapticctlSaysWhichOfItsProgramsIsMissing) {
  const TemporaryFolder folder;
  const std::string alone = folder.path() / "bin/hapticctl";
  std::filesystem::create_directory(folder.path() / "bin");
  std::filesystem::copy_file(HAPTICCTL_PROGRAM, alone);
  EXPECT_EQ(runToEnd({alone, "--help"}).ending, exitedWith(0));
  for (const Words& command :
       std::vector<Words>{{"trace", "info", "x"}, {"doctor", "--help"}, {"help", "calibrate"}}) {
    Words line{alone};
    line.insert(line.end(), command.begin(), command.end());
    const Finished refused = runToEnd(line);
    EXPECT_EQ(refused.ending, exitedWith(1)) << command[0];
    EXPECT_EQ(refused.output, "") << command[0];
    EXPECT_NE(refused.errors.find("/libexec/hapticd/hapticctl-"), std::string::npos) << refused.errors;
    EXPECT_NE(refused.errors.find("cannot be executed: No such file"), std::string::npos) << refused.errors;
  }
}

TEST(ProgramOptions, TheDaemonTakesTheStandardConfigurationAndSaysSo) {
  const std::string standard = "/etc/hapticd/hapticd.yaml";
  const Finished checked = runToEnd({HAPTICD_PROGRAM, "--check"});
  EXPECT_NE(checked.errors.find("hapticd: takes the standard configuration " + standard), std::string::npos)
      << checked.errors;
  if (std::filesystem::exists(standard)) {
    EXPECT_NE(checked.output.find(standard + ": "), std::string::npos) << checked.output;
  } else {
    EXPECT_EQ(checked.ending, exitedWith(78));
    EXPECT_NE(checked.errors.find(standard + ": cannot be read: No such file"), std::string::npos)
        << checked.errors;
  }
}

/// Runs a command with its standard output redirected to `output`.
Finished runInto(const char* output, const Words& command) {
  Words line{"/bin/sh", "-c", std::string("exec \"$@\" > ") + output, "sh"};
  line.insert(line.end(), command.begin(), command.end());
  return runToEnd(line);
}

void expectLost(const Words& command, const char* program) {
  const Finished finished = runInto("/dev/full", command);
  EXPECT_EQ(finished.ending, exitedWith(1)) << command[0] << " " << command[1] << ": " << finished.errors;
  EXPECT_TRUE(finished.errors.ends_with(std::string(program) +
                                        ": cannot write to standard output: No space left on device\n"))
      << command[0] << " " << command[1] << ": " << finished.errors;
}

TEST(ProgramOptions, HelpAndVersionThatAreLostAreAnError) {
  for (const Subject& program : kPrograms) {
    expectLost({program.path, "--version"}, program.name);
    visitCommands({program.path}, [&](Words line, const std::string&) {
      line.push_back("--help");
      expectLost(line, program.name);
    });
  }
}

}  // namespace
}  // namespace hapticd::test
