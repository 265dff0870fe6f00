// SPDX-License-Identifier: Apache-2.0
// hapticctl watch, events and status on a terminal of their own, and across a restart of the daemon.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <memory>
#include <sstream>

#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/terminal_program.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

constexpr const char* kEnter = "\033[?1049h\033[?25l";
constexpr const char* kLeave = "\033[?25h\033[?1049l";
const std::vector<std::string> kUtf8{"PATH=/usr/bin:/bin", "TERM=xterm", "LANG=C.UTF-8"};
const std::vector<std::string> kAscii{"PATH=/usr/bin:/bin", "TERM=xterm", "LANG=C"};

class HapticctlWatch : public testing::Test {
 protected:
  void SetUp() override { start("control.engage_at_start=true"); }

  void start(const std::string& set) {
    daemon = std::make_unique<Daemon>(home, kWallYaml, std::vector{set});
    ASSERT_TRUE(daemon->answers());
  }
  bool pressesTheWall() {
    return daemon->reaches([](const json& status) {
      return status["mode"] == "engaged" && lengthOf(status["tick"]["commandForceNInWorld"]) > 1;
    });
  }
  std::unique_ptr<TerminalProgram> watch(const std::vector<std::string>& environment = kUtf8,
                                         int columns = 80) {
    auto program =
        std::make_unique<TerminalProgram>(home.controlCommand({"watch"}), environment, 24, columns);
    EXPECT_TRUE(program->prints("Ctrl-C ends")) << program->output();
    return program;
  }

  const DaemonHome home;
  std::unique_ptr<Daemon> daemon;
};

/// The terminal is as before: the last thing that is printed leaves the other screen and shows the cursor.
testing::AssertionResult leavesCleanly(TerminalProgram& program) {
  const std::string& output = program.output();
  const std::size_t enter = output.find(kEnter);
  const std::size_t leave = output.rfind(kLeave);
  if (enter == std::string::npos)
    return testing::AssertionFailure() << "it never took the screen: " << output;
  if (leave == std::string::npos) return testing::AssertionFailure() << "it kept the screen: " << output;
  if (output.find("\033[?25l", leave) == std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "it took the screen again: " << output;
}

void expectCleanEndOnCtrlC(TerminalProgram& program) {
  program.press('\3');
  EXPECT_EQ(program.wait(), exitedWith(0));
  EXPECT_TRUE(leavesCleanly(program));
}

TEST_F(HapticctlWatch, ShowsTheStateAndAForceHistoryUntilCtrlC) {
  ASSERT_TRUE(pressesTheWall());
  const auto program = watch();
  EXPECT_TRUE(contains(program->output(), "mode          engaged"));
  EXPECT_TRUE(contains(program->output(), "     0 N |█"));
  expectCleanEndOnCtrlC(*program);
}

TEST_F(HapticctlWatch, DrawsWithPlainSignsWhereTheTerminalKnowsNoOthers) {
  ASSERT_TRUE(pressesTheWall());
  const auto program = watch(kAscii);
  ASSERT_TRUE(program->prints("     0 N |#"));
  for (const char byte : program->output()) EXPECT_GE(byte, 0);
}

TEST_F(HapticctlWatch, PrintsPlainLinesOnATerminalWithoutControlSequences) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"watch", "--count", "1"},
                                                    {"watch", "--line", "--count", "1"},
                                                    {"watch", "--summary", "--count", "1"},
                                                    {"status"}}) {
    TerminalProgram program(home.controlCommand(arguments), {"PATH=/usr/bin:/bin", "TERM=dumb", "LANG=C"}, 24,
                            80);
    EXPECT_EQ(program.wait(), exitedWith(0));
    EXPECT_FALSE(program.output().empty());
    EXPECT_EQ(program.output().find('\033'), std::string::npos) << program.output();
  }
}

TEST_F(HapticctlWatch, LeavesTheTerminalCleanOnSigterm) {
  const auto program = watch();
  program->signal(SIGTERM);
  EXPECT_EQ(program->wait(), exitedWith(0));
  EXPECT_TRUE(leavesCleanly(*program));
}

TEST_F(HapticctlWatch, SurvivesTheDeathOfTheDaemonAndShowsTheNextOne) {
  const auto program = watch(kUtf8, 120);
  daemon->signal(SIGKILL);
  daemon->wait();
  ASSERT_TRUE(program->prints("! the connection is lost, trying again until Ctrl-C"));
  start("control.engage_at_start=false");
  ASSERT_TRUE(program->prints("mode          idle"));
  expectCleanEndOnCtrlC(*program);
}

TEST_F(HapticctlWatch, LinesGoOnAfterARestartAndStandardErrorSaysSo) {
  Program program(home.controlCommand({"watch"}));
  ASSERT_TRUE(becomesTrue([&] { return program.output().find("engaged") != std::string::npos; }));
  daemon->terminate();
  start("control.engage_at_start=false");
  ASSERT_TRUE(becomesTrue([&] { return program.output().find("idle") != std::string::npos; }));
  EXPECT_TRUE(contains(program.errors(), "the connection is lost, trying again until Ctrl-C ("));
  EXPECT_TRUE(contains(program.errors(), "hapticctl: connected to hapticd again\n"));
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), exitedWith(0));
}

TEST_F(HapticctlWatch, EventsGoOnAfterARestartWithoutRepeatingOldOnes) {
  ASSERT_EQ(home.control({"set", "force.stiffness_n_per_m=301"}).ending, exitedWith(0));
  Program events(home.controlCommand({"events", "--follow"}));
  const auto count = [&](const std::string& part) {
    const std::string output = events.output();
    int found = 0;
    for (std::size_t at = 0; (at = output.find(part, at)) != std::string::npos; ++at) ++found;
    return found;
  };
  ASSERT_TRUE(becomesTrue([&] { return count("to 301") == 1; })) << events.output();
  daemon->terminate();
  start("control.engage_at_start=false");
  ASSERT_TRUE(becomesTrue(
      [&] { return events.errors().find("hapticctl: connected to hapticd again\n") != std::string::npos; }));
  ASSERT_EQ(home.control({"set", "force.stiffness_n_per_m=302"}).ending, exitedWith(0));
  ASSERT_TRUE(becomesTrue([&] { return count("to 302") == 1; })) << events.output();
  EXPECT_EQ(count("to 301"), 1) << events.output();
  events.signal(SIGTERM);
  EXPECT_EQ(events.wait(), exitedWith(0));
}

TEST_F(HapticctlWatch, TheFirstLineShowsTheNewestTickWhereNoWindowIsFullYet) {
  ASSERT_TRUE(pressesTheWall());
  const std::string line = home.control({"watch", "--count", "1"}).output;
  EXPECT_TRUE(contains(line, "contact 100 %  force "));
  EXPECT_FALSE(contains(line, "force -..- N"));
}

TEST_F(HapticctlWatch, EndsWhenItsTerminalIsGone) {
  const auto program = watch();
  program->hangUp();
  EXPECT_TRUE(program->wait().exited);
}

TEST_F(HapticctlWatch, FollowsTheSizeOfTheTerminal) {
  const auto program = watch();
  const std::size_t before = program->output().size();
  program->resize(20, 40);
  ASSERT_TRUE(becomesTrue([&] {
    return program->output().find("handle        present, ", before) != std::string::npos &&
           program->output().find("...", before) != std::string::npos;
  })) << program->output();
}

TEST_F(HapticctlWatch, GivesTheTerminalBackWhileItIsStopped) {
  const auto program = watch();
  program->press('\x1a');  // Ctrl-Z
  ASSERT_TRUE(program->prints(kLeave));
  const std::size_t stopped = program->output().size();
  ASSERT_TRUE(becomesTrue([&] {
    program->signal(SIGCONT);  // again, because the first may come before the stop
    return program->output().find(kEnter, stopped) != std::string::npos;
  }));
  expectCleanEndOnCtrlC(*program);
}

TEST_F(HapticctlWatch, PrintsALineForEachStateWhenItsOutputIsNoTerminal) {
  const std::string lines = home.control({"watch", "--interval", "20", "--count", "3"}).output;
  EXPECT_EQ(std::ranges::count(lines, '\n'), 3) << lines;
  std::istringstream objects(home.control({"--json", "watch", "--interval", "20", "--count", "2"}).output);
  int count = 0;
  for (std::string line; std::getline(objects, line); ++count)
    EXPECT_EQ(json::parse(line)["droppedCount"], 0);
  EXPECT_EQ(count, 2);
}

TEST_F(HapticctlWatch, EndsQuietlyWhenNobodyReadsItsLines) {
  std::vector<std::string> line{"/bin/sh", "-c", "\"$@\" | true", "sh"};
  for (const std::string& word : home.controlCommand({"watch", "--interval", "20"})) line.push_back(word);
  const Finished finished = runToEnd(line);
  EXPECT_EQ(finished.ending, exitedWith(0));
  EXPECT_EQ(finished.errors, "");
}

TEST_F(HapticctlWatch, AsJsonAsksForTheFieldsThatAreNamedElseForAll) {
  const auto status = [this](std::vector<std::string> more) {
    more.insert(more.begin(), {"--json", "watch", "--count", "1"});
    return json::parse(home.control(more).output).at("status");
  };
  EXPECT_GT(status({}).size(), 10U);
  const json some = status({"--fields", "mode,loop.rateHz"});
  EXPECT_EQ(some.size(), 2U) << some;
  EXPECT_EQ(some["loop"].size(), 1U) << some;
}

TEST_F(HapticctlWatch, StatusHasColoursOnATerminalUnlessToldOtherwise) {
  const auto output = [&](const std::vector<std::string>& arguments, std::vector<std::string> environment) {
    TerminalProgram status(home.controlCommand(arguments), std::move(environment), 24, 80);
    EXPECT_EQ(status.wait(), exitedWith(0));
    return status.output();
  };
  std::vector<std::string> no_color = kUtf8;
  no_color.emplace_back("NO_COLOR=1");
  const std::string coloured_mode = "mmode";  // the letter ends the sequence that chooses the colour
  EXPECT_TRUE(contains(output({"status"}, kUtf8), coloured_mode));
  EXPECT_FALSE(contains(output({"status"}, no_color), "\033["));
  EXPECT_FALSE(contains(output({"--color=never", "status"}, kUtf8), "\033["));
  EXPECT_TRUE(contains(home.control({"--color=always", "status"}).output, coloured_mode));
  EXPECT_FALSE(contains(home.control({"status"}).output, "\033["));
}

}  // namespace
}  // namespace hapticd::test
