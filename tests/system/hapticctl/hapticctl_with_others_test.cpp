// SPDX-License-Identifier: Apache-2.0
// hapticctl with others than its daemon: the service of the live picture, a terminal, HDF5, and the shells
// that complete its command lines.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

#include "tests/support/made_up_trace.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/loopback_listener.h"
#include "tests/system/support/terminal_program.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

// --- the address of the live picture

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

class HapticctlView : public testing::Test {
 protected:
  std::string tokenFile() const { return (home.path() / "token").string(); }
  void writeToken(const std::string& text) const { std::ofstream(tokenFile()) << text << '\n'; }
  std::vector<std::string> viewAt(const LoopbackListener& listener) const {
    return {"view", "--port", listener.port(), "--token-file", tokenFile()};
  }
  const DaemonHome home;
};

TEST_F(HapticctlView, PrintsTheAddressesWithTheToken) {
  const LoopbackListener listener;
  writeToken(kToken);
  const Finished shown = home.control(viewAt(listener));
  EXPECT_EQ(shown.ending, exitedWith(0)) << shown.errors;
  const std::string place = "127.0.0.1:" + listener.port() + "/?token=" + kToken;
  EXPECT_TRUE(contains(shown.output, " http://" + place + "\n"));
  EXPECT_TRUE(contains(shown.output, " ws://" + place + "\n"));
  EXPECT_TRUE(contains(shown.output, "ssh -L " + listener.port() + ":127.0.0.1:" + listener.port()))
      << shown.output;

  std::vector<std::string> as_json = viewAt(listener);
  as_json.insert(as_json.begin(), "--json");
  const auto json = nlohmann::json::parse(home.control(as_json).output);
  std::vector<std::string> lost{"/bin/sh", "-c", "exec \"$@\" >/dev/full", "sh"};
  for (const std::string& word : home.controlCommand(viewAt(listener))) lost.push_back(word);
  EXPECT_EQ(runToEnd(lost).ending, exitedWith(1));
  EXPECT_EQ(json, (nlohmann::json{{"page", "http://" + place}, {"foxglove", "ws://" + place}}));
}

TEST_F(HapticctlView, WaitsForAServiceThatItsConnectionStarts) {
  LoopbackListener listener;
  std::thread service([&] {
    listener.accept();
    writeToken(kToken);
  });
  const Finished shown = home.control(viewAt(listener));
  service.join();
  EXPECT_EQ(shown.ending, exitedWith(0)) << shown.errors;
  EXPECT_TRUE(contains(shown.output, kToken));
}

TEST_F(HapticctlView, NamesTheRemedyWhereNobodyListens) {
  LoopbackListener listener;
  const std::vector<std::string> command = viewAt(listener);
  listener.close();
  const Finished shown = home.control(command);
  EXPECT_EQ(shown.ending, exitedWith(3));
  EXPECT_TRUE(contains(shown.errors, "systemctl enable --now hapticd-view.socket"));
}

TEST_F(HapticctlView, NamesAFileThatHoldsNoToken) {
  const LoopbackListener listener;
  for (const char* text : {"", "0123456789ABCDEF0123456789ABCDEF"}) {
    writeToken(text);
    const Finished shown = home.control(viewAt(listener));
    EXPECT_EQ(shown.ending, exitedWith(1)) << text;
    EXPECT_TRUE(contains(shown.errors, tokenFile()));
    EXPECT_EQ(shown.output, "");
  }
}

TEST_F(HapticctlView, NamesTheGroupWhereTheFileMayNotBeRead) {
  if (::geteuid() != 0) GTEST_SKIP() << "takes root, to become another user";
  const LoopbackListener listener;
  writeToken(kToken);
  std::filesystem::permissions(home.path(), std::filesystem::perms(0755));
  std::filesystem::permissions(tokenFile(), std::filesystem::perms(0640));
  const Finished shown = runToEnd(home.controlCommand(viewAt(listener)), {.user = 65534});
  EXPECT_EQ(shown.ending, exitedWith(1));
  EXPECT_TRUE(contains(shown.errors, "haptic-view"));
}

// --- trace files

constexpr std::size_t kTicks = 2000;

class HapticctlTraceFiles : public testing::Test {
 protected:
  HapticctlTraceFiles() { writeTrace(trace, madeUpRecords(2, kTicks / 2), kTicks / 2); }

  std::string file(const std::string& name) const { return (home.path() / name).string(); }

  const DaemonHome home;
  const std::string trace = file("a.mcap");
};

TEST_F(HapticctlTraceFiles, LongWorkShowsHowFarItIsOnATerminal) {
  TerminalProgram program(home.controlCommand({"trace", "export", trace, "--out", file("a.csv")}),
                          {"TERM=xterm"}, 24, 80);
  EXPECT_EQ(program.wait(), exitedWith(0));
  EXPECT_TRUE(contains(program.output(), "exporting")) << program.output();
  EXPECT_TRUE(contains(program.output(), "2000 rows")) << program.output();
}

// --- completion in shells; zsh offers it in a terminal only, so its functions that take it print it instead

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
  std::filesystem::create_symlink(HAPTICCTL_PROGRAM, folder.path("bin/hapticctl"));
  std::ofstream(home + "/view.png") << "";
  Words command = GetParam().command;
  command.push_back("export PATH=" + folder.path("bin") + ":/usr/bin:/bin\n" + GetParam().script);
  const Finished result = runToEnd(command, {.environment = {"HOME=" + home}});
  EXPECT_EQ("", result.errors);
  const Words expected{home + "/view.png", "nearest_springs", "start", "stop"};
  EXPECT_EQ(expected, linesOf(result.output));
}

INSTANTIATE_TEST_SUITE_P(Shells, CompletionOf, testing::Values(kBash, kZsh, kFish),
                         [](const auto& shell) { return shell.param.name; });

}  // namespace
}  // namespace hapticd::test
