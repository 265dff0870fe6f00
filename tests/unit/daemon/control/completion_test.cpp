// SPDX-License-Identifier: Apache-2.0
// What `hapticctl __complete` offers, and that each shell shows it. zsh offers completions in a terminal
// only, so its functions that take them print them instead.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "config/settings/parameter_table.h"
#include "control_fixture.h"
#include "tests/support/program.h"

namespace hapticd::daemon::test {
namespace {

using Words = std::vector<std::string>;

/// The lines of a text that are not empty, sorted; of each what stands before a tab.
Words linesOf(const std::string& text) {
  std::istringstream lines(text);
  Words words;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) words.push_back(line.substr(0, line.find('\t')));
  }
  std::ranges::sort(words);
  return words;
}

class Completion : public ControlFixture {
 protected:
  /// Returns what is offered for the last word of a command line that begins with hapticctl.
  static Words completions(Words words) {
    words.front() = "__complete";
    words.insert(words.begin(), HAPTICCTL);
    const hapticd::test::Finished result = hapticd::test::runToEnd(words);
    EXPECT_EQ("", result.errors);
    return linesOf(result.output);
  }
};

TEST_F(Completion, OffersTheCommandsOfTheHelp) {
  const Words offered = completions({"hapticctl", ""});
  const std::string help = hapticd::test::runToEnd({HAPTICCTL, "--help"}).output;
  std::string listed = help.substr(help.find("Subcommands:"));
  listed.resize(listed.find("\n\n"));
  std::size_t commands = 0;
  for (std::size_t at = 0; (at = listed.find("\n  ", at)) != std::string::npos; at += 3) {
    if (listed.at(at + 3) != ' ') ++commands;  // else the text of a command goes on
  }
  EXPECT_EQ(commands, offered.size());
  for (const std::string& command : offered) {
    EXPECT_NE(std::string::npos, listed.find("\n  " + command + " ")) << command;
  }
  EXPECT_EQ((Words{"set"}), completions({"hapticctl", "--json", "se"}));
  EXPECT_EQ((Words{"disengage", "doctor"}), completions({"hapticctl", "--socket", "/x", "d"}));
}

TEST_F(Completion, OffersTheCommandsOfAGroup) {
  EXPECT_EQ((Words{"start", "stop"}), completions({"hapticctl", "trace", "st"}));
  EXPECT_EQ((Words{"--label"}), completions({"hapticctl", "--json", "trace", "start", "--la"}));
}

TEST_F(Completion, OffersTheOptions) {
  EXPECT_EQ((Words{"--socket"}), completions({"hapticctl", "--s"}));
  EXPECT_EQ((Words{"--interval"}), completions({"hapticctl", "watch", "--i"}));
  EXPECT_EQ((Words{"--root"}), completions({"hapticctl", "doctor", "--r"}));
}

TEST_F(Completion, OffersWhatAnOptionTakes) {
  EXPECT_EQ((Words{"csv", "recording", "rosbag2"}),
            completions({"hapticctl", "trace", "export", "--format", ""}));
  EXPECT_EQ((Words{}), completions({"hapticctl", "watch", "--interval", ""}));
}

TEST_F(Completion, OffersTheKindsOfEventsAndWhatAListIsSortedBy) {
  EXPECT_EQ(4U,  // camera, calibration, clear_fault, configuration
            completions({"hapticctl", "events", "--kind", "c"}).size());
  EXPECT_EQ((Words{"name", "size", "time"}), completions({"hapticctl", "trace", "list", "--sort", ""}));
}

TEST_F(Completion, OffersTheCommandsThatThereIsHelpFor) {
  EXPECT_EQ((Words{"status"}), completions({"hapticctl", "help", "stat"}));
}

TEST_F(Completion, LeavesFilesToTheShell) {
  EXPECT_EQ((Words{":files"}), completions({"hapticctl", "snapshot", "--png", "vi"}));
  EXPECT_EQ((Words{":files"}),
            completions({"hapticctl", "--socket", folder.path("none"), "trace", "info", ""}));
}

TEST_F(Completion, OffersEveryParameterToGet) {
  EXPECT_EQ(config::parameterTable().size(), completions({"hapticctl", "get", ""}).size());
  EXPECT_EQ((Words{"camera.near_m"}), completions({"hapticctl", "get", "camera.ne"}));
}

TEST_F(Completion, OffersOnlyLiveParametersToSet) {
  EXPECT_EQ((Words{"force.radius_m="}), completions({"hapticctl", "set", "force.r"}));
  EXPECT_EQ((Words{}), completions({"hapticctl", "set", "camera.ne"}));
}

TEST_F(Completion, OffersTheWordsOfAChoice) {
  EXPECT_EQ((Words{"force.law=auto", "force.law=nearest_springs", "force.law=proxy",
                   "force.law=smooth_springs", "force.law=surface"}),
            completions({"hapticctl", "set", "force.law="}));
  EXPECT_EQ((Words{"force.law=nearest_springs"}), completions({"hapticctl", "set", "force.law=near"}));
  EXPECT_EQ((Words{"force.law=nearest_springs"}), completions({"hapticctl", "set", "force.law", "=", "near"}))
      << "as bash separates words";
}

TEST_F(Completion, OffersTheProfilesOfTheDaemon) {
  start();
  for (const char* name : {"soft", "stiff"}) {
    askControl("io.hapticd.Control.SaveProfile", R"({"name":")" + std::string(name) + R"("})");
  }
  const Words line{"hapticctl", "--socket", controlPath(), "load", "s"};
  EXPECT_EQ((Words{"soft", "stiff"}), completions(line));
  EXPECT_EQ((Words{"stiff"}),
            completions({"hapticctl", "--socket", controlPath(), "profiles", "--boot", "st"}));
  EXPECT_EQ((Words{}), completions({"hapticctl", "--socket", folder.path("none"), "load", ""}));
}

TEST_F(Completion, OffersTheTracesOfTheDaemon) {
  start();
  const auto name = askControl("io.hapticd.Control.StartTrace")["parameters"]["name"].get<std::string>();
  const std::string begin = name.substr(0, 2);
  EXPECT_EQ((Words{name}), completions({"hapticctl", "--socket", controlPath(), "trace", "delete", begin}));
  EXPECT_EQ((Words{name, ":files"}),
            completions({"hapticctl", "--socket", controlPath(), "trace", "info", begin}));
  EXPECT_EQ((Words{name}), completions({"hapticctl", "--socket", controlPath(), "trace", "note", begin}));
}

TEST_F(Completion, OffersTheFixturesAndRegionsOfTheDaemon) {
  start();
  askControl("io.hapticd.Control.ChangeFixtures",
             R"({"add":[{"name":"nerve","kind":"point","position_m":[0,0,-1]},)"
             R"({"name":"vein","kind":"point","position_m":[0,0,-1]}]})");
  askControl("io.hapticd.Control.ChangeRegions",
             R"({"add":[{"name":"liver","shape":"sphere","position_m":[0,0,-1],"radius_m":0.05}]})");
  const auto offered = [&](const Words& command) {
    Words words{"hapticctl", "--socket", controlPath()};
    words.insert(words.end(), command.begin(), command.end());
    return completions(words);
  };
  EXPECT_EQ((Words{"nerve", "vein"}), offered({"fixture", "enable", ""}));
  EXPECT_EQ((Words{"vein"}), offered({"fixture", "show", "v"}));
  EXPECT_EQ((Words{"liver"}), offered({"region", "remove", "l"}));
  EXPECT_EQ((Words{"box", "path", "plane", "sphere"}), offered({"fixture", "touch", "--kind", ""}));
}

/// A shell, and a script for it that prints what it offers behind "hapticctl set force.law=near", "hapticctl
/// trace st" and "hapticctl snapshot --png FOLDER/vi".
struct Shell {
  const char* name;
  Words command;
  const char* script;

  friend std::ostream& operator<<(std::ostream& stream, const Shell& shell) { return stream << shell.name; }
};

const Shell kBash{"bash", {"/bin/bash", "--norc", "-c"}, R"sh(
    source <(hapticctl completion bash)
    offer() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _hapticctl; printf '%s\n' "${COMPREPLY[@]}"; }
    offer hapticctl set force.law = near
    offer hapticctl trace st
    offer hapticctl snapshot --png "$HOME/vi")sh"};

const Shell kZsh{"zsh", {"/bin/zsh", "-f", "-c"}, R"sh(
    compadd() { true }
    _describe() { local word; for word in "${(@P)2}"; do print -r -- "${${word%%:*}#force.law=}"; done }
    _files() { print -rl -- "$PREFIX"*(N) }
    source <(hapticctl completion zsh)
    offer() { words=("$@"); CURRENT=$#; PREFIX="$words[CURRENT]"; _hapticctl }
    offer hapticctl set force.law=near
    offer hapticctl trace st
    offer hapticctl snapshot --png "$HOME/vi")sh"};

const Shell kFish{"fish", {"/usr/bin/fish", "--no-config", "-c"}, R"sh(
    hapticctl completion fish | source
    complete -C 'hapticctl set force.law=near' | string replace 'force.law=' ''
    complete -C 'hapticctl trace st'
    complete -C "hapticctl snapshot --png $HOME/vi")sh"};

class CompletionOf : public testing::TestWithParam<Shell> {};

TEST_P(CompletionOf, ShowsTheCandidates) {
  const TemporaryFolder folder;
  const std::string home = folder.path("home");
  std::filesystem::create_directories(home);
  std::filesystem::create_directories(folder.path("bin"));
  std::filesystem::create_symlink(HAPTICCTL, folder.path("bin/hapticctl"));
  std::ofstream(home + "/view.png") << "";
  Words command = GetParam().command;
  command.push_back("export PATH=" + folder.path("bin") + ":/usr/bin:/bin\n" + GetParam().script);
  const hapticd::test::Finished result = hapticd::test::runToEnd(command, {.environment = {"HOME=" + home}});
  EXPECT_EQ("", result.errors);
  const Words expected{home + "/view.png", "nearest_springs", "start", "stop"};
  EXPECT_EQ(expected, linesOf(result.output));
}

INSTANTIATE_TEST_SUITE_P(Shells, CompletionOf, testing::Values(kBash, kZsh, kFish),
                         [](const auto& shell) { return shell.param.name; });

}  // namespace
}  // namespace hapticd::daemon::test
