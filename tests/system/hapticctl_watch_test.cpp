// SPDX-License-Identifier: Apache-2.0
// hapticctl watch and status on a terminal of their own.
#include <gtest/gtest.h>
#include <signal.h>

#include <functional>
#include <memory>

#include "tests/system/fake_daemon.h"
#include "tests/system/fake_replies.h"
#include "tests/system/hapticctl_home.h"
#include "tests/system/terminal_program.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

constexpr const char* kEnter = "\033[?1049h\033[?25l";
constexpr const char* kLeave = "\033[?25h\033[?1049l";
const std::vector<std::string> kUtf8{"PATH=/usr/bin:/bin", "TERM=xterm", "LANG=C.UTF-8"};
const std::vector<std::string> kAscii{"PATH=/usr/bin:/bin", "TERM=xterm", "LANG=C"};

class HapticctlWatch : public testing::Test {
 protected:
  HapticctlWatch() : daemon(std::make_unique<FakeDaemon>(home.socket())) { answerEverything(*daemon); }

  /// Ends the daemon and starts another one, with `patch` in its status.
  void restart(const json& patch, const std::function<void(FakeDaemon&)>& prepare = {}) {
    daemon.reset();
    std::filesystem::remove(home.socket());
    const json status = statusWith(patch);
    auto again = std::make_unique<FakeDaemon>(home.path() / "next");
    answerEverything(*again);
    again->answer(
        "io.hapticd.Status.Monitor",
        FakeAnswer{.replies = {{{"status", status}, {"window", json::object()}, {"droppedCount", 0}}},
                   .endless = true});
    if (prepare) prepare(*again);
    std::filesystem::rename(home.path() / "next", home.socket());  // only now it can be reached
    daemon = std::move(again);
  }

  HapticctlHome home;
  std::unique_ptr<FakeDaemon> daemon;
};

/// The terminal is as before: the last thing that is printed leaves the other screen and shows the cursor.
testing::AssertionResult leavesCleanly(const std::string& output) {
  const std::size_t enter = output.find(kEnter);
  const std::size_t leave = output.rfind(kLeave);
  if (enter == std::string::npos)
    return testing::AssertionFailure() << "it never took the screen: " << output;
  if (leave == std::string::npos) return testing::AssertionFailure() << "it kept the screen: " << output;
  if (output.find("\033[?25l", leave) == std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "it took the screen again: " << output;
}

TEST_F(HapticctlWatch, ShowsTheStateAndAForceHistory) {
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 80);
  ASSERT_TRUE(watch.prints("Ctrl-C ends"));
  EXPECT_TRUE(has(watch.output(), "mode          engaged"));
  EXPECT_TRUE(has(watch.output(), "   2.0 N | "));  // 1.5 N fill three of four rows
  EXPECT_TRUE(has(watch.output(), "     0 N |█"));
}

TEST_F(HapticctlWatch, DrawsWithPlainSignsWhereTheTerminalKnowsNoOthers) {
  TerminalProgram watch(home.command({"watch"}), kAscii, 24, 80);
  ASSERT_TRUE(watch.prints("     0 N |#"));
  for (const char byte : watch.output()) EXPECT_GE(byte, 0);
}

TEST_F(HapticctlWatch, PrintsPlainLinesOnATerminalWithoutControlSequences) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"watch"}, {"watch", "--line"}, {"watch", "--summary"}, {"status"}}) {
    std::vector<std::string> all = arguments;
    if (all[0] == "watch") all.insert(all.end(), {"--count", "1"});
    TerminalProgram watch(home.command(all), {"PATH=/usr/bin:/bin", "TERM=dumb", "LANG=C"}, 24, 80);
    EXPECT_EQ(watch.wait(), exitedWith(0));
    EXPECT_FALSE(watch.output().empty());
    EXPECT_EQ(watch.output().find('\033'), std::string::npos) << watch.output();
  }
}

TEST_F(HapticctlWatch, LeavesTheTerminalCleanOnCtrlC) {
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 80);
  ASSERT_TRUE(watch.prints("Ctrl-C ends"));
  watch.press('\3');
  EXPECT_EQ(watch.wait(), exitedWith(0));
  EXPECT_TRUE(leavesCleanly(watch.output()));
}

TEST_F(HapticctlWatch, LeavesTheTerminalCleanOnSigterm) {
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 80);
  ASSERT_TRUE(watch.prints("Ctrl-C ends"));
  watch.signal(SIGTERM);
  EXPECT_EQ(watch.wait(), exitedWith(0));
  EXPECT_TRUE(leavesCleanly(watch.output()));
}

TEST_F(HapticctlWatch, LeavesTheTerminalCleanAndSaysSoWhenTheDaemonDies) {
  daemon->answer(
      "io.hapticd.Status.Monitor",
      FakeAnswer{.replies = {{{"status", goodStatus()}, {"window", json::object()}, {"droppedCount", 0}},
                             {{"status", goodStatus()}, {"window", json::object()}, {"droppedCount", 0}}},
                 .endless = true,
                 .hangs_up = true});
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 80);
  ASSERT_TRUE(watch.prints("! the connection is lost, trying again until Ctrl-C"));
  watch.press('\3');
  EXPECT_EQ(watch.wait(), exitedWith(0));
  EXPECT_TRUE(leavesCleanly(watch.output()));
}

TEST_F(HapticctlWatch, SurvivesARestartOfTheDaemonAndSaysSo) {
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 120);
  ASSERT_TRUE(watch.prints("Ctrl-C ends"));
  restart({{"mode", "idle"}});
  ASSERT_TRUE(watch.prints("mode          idle"));
  EXPECT_TRUE(has(watch.output(), "trying again until Ctrl-C"));
  watch.press('\3');
  EXPECT_EQ(watch.wait(), exitedWith(0));
  EXPECT_TRUE(leavesCleanly(watch.output()));
}

TEST_F(HapticctlWatch, LinesGoOnAfterARestartAndStandardErrorSaysSo) {
  Program watch(home.command({"watch"}));
  ASSERT_TRUE(becomesTrue([&] { return has(watch.output(), "engaged"); }));
  restart({{"mode", "idle"}});
  ASSERT_TRUE(becomesTrue([&] { return has(watch.output(), "idle"); })) << watch.errors();
  EXPECT_TRUE(has(watch.errors(), "hapticctl: ")) << watch.errors();
  EXPECT_TRUE(has(watch.errors(), "the connection is lost, trying again until Ctrl-C (")) << watch.errors();
  EXPECT_TRUE(has(watch.errors(), "hapticctl: connected to hapticd again\n")) << watch.errors();
  watch.signal(SIGTERM);
  EXPECT_EQ(watch.wait(), exitedWith(0));
}

TEST_F(HapticctlWatch, EventsGoOnAfterARestartWithoutRepeatingOldOnes) {
  const auto event = [](int number, std::int64_t time_ns, const char* text) {
    return json{{"event", {{"number", number}, {"timeNs", time_ns}, {"kind", "mode"}, {"text", text}}},
                {"droppedCount", 0}};
  };
  const auto answer = [&](FakeDaemon& events, std::vector<json> replies) {
    events.answer("io.hapticd.Status.Events", FakeAnswer{.replies = std::move(replies), .endless = true});
  };
  answer(*daemon, {event(1, 1000, "the first"), event(2, 2000, "the second")});
  Program events(home.command({"events", "--follow"}));
  ASSERT_TRUE(becomesTrue([&] { return has(events.output(), "the second"); }));
  restart({}, [&](FakeDaemon& again) {
    answer(again, {event(2, 2000, "the second"), event(1, 3000, "after the restart")});
  });
  ASSERT_TRUE(becomesTrue([&] { return has(events.output(), "after the restart"); })) << events.errors();
  EXPECT_TRUE(has(events.errors(), "hapticctl: connected to hapticd again\n")) << events.errors();
  const std::string output = events.output();
  EXPECT_EQ(output.find("the second"), output.rfind("the second")) << output;
  events.signal(SIGTERM);
  EXPECT_EQ(events.wait(), exitedWith(0));
}

TEST_F(HapticctlWatch, TheFirstLineShowsTheNewestTickWhereNoWindowIsFullYet) {
  const json empty{{"ticks", 0}, {"contactTicks", 0}, {"minForceN", nullptr}, {"maxForceN", nullptr}};
  daemon->answer("io.hapticd.Status.Monitor",
                 FakeAnswer{.replies = {{{"status", statusWith({{"tick", {{"wakeupLatencyNs", 4000}}}})},
                                         {"window", empty},
                                         {"droppedCount", 0}}},
                            .endless = true});
  const std::string line = home.run({"watch", "--count", "1"}).output;
  EXPECT_TRUE(has(line, "contact 100 %  force 5.00..5.00 N  wake-up max 4.0 us")) << line;
}

TEST_F(HapticctlWatch, EndsWhenItsTerminalIsGone) {
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 80);
  ASSERT_TRUE(watch.prints("Ctrl-C ends"));
  watch.hangUp();
  EXPECT_TRUE(watch.wait().exited);
}

TEST_F(HapticctlWatch, FollowsTheSizeOfTheTerminal) {
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 80);
  ASSERT_TRUE(watch.prints("Ctrl-C ends"));
  ASSERT_TRUE(has(watch.output(), "handle        present, 61500 measurements, simulated"));
  const std::size_t before = watch.output().size();
  watch.resize(20, 40);
  ASSERT_TRUE(becomesTrue([&] { return watch.output().size() > before; }));
  ASSERT_TRUE(watch.prints("handle        present, 61500 measurem..."));
}

TEST_F(HapticctlWatch, GivesTheTerminalBackWhileItIsStopped) {
  TerminalProgram watch(home.command({"watch"}), kUtf8, 24, 80);
  ASSERT_TRUE(watch.prints("Ctrl-C ends"));
  watch.press('\x1a');  // Ctrl-Z
  ASSERT_TRUE(watch.prints(kLeave));
  const std::size_t stopped = watch.output().size();
  watch.signal(SIGCONT);
  ASSERT_TRUE(becomesTrue([&] {
    if (watch.output().find(kEnter, stopped) != std::string::npos) return true;
    watch.signal(SIGCONT);  // the first may have come before the stop
    return false;
  }));
  watch.press('\3');
  EXPECT_EQ(watch.wait(), exitedWith(0));
  EXPECT_TRUE(leavesCleanly(watch.output()));
}

TEST_F(HapticctlWatch, EndsQuietlyWhenNobodyReadsItsLines) {
  const Finished finished =
      runToEnd({"/bin/sh", "-c",
                "'" HAPTICCTL_PROGRAM "' --socket '" + home.socket().string() + "' watch --count 1 | true"});
  EXPECT_EQ(finished.ending, exitedWith(0));
  EXPECT_EQ(finished.errors, "");
}

TEST_F(HapticctlWatch, AsksOnlyForTheFieldsThatItsLinesShow) {
  EXPECT_EQ(home.run({"watch", "--count", "1"}).ending, exitedWith(0));
  const json fields = daemon->newestCall("io.hapticd.Status.Monitor")["fields"];
  EXPECT_TRUE(fields.is_array() && fields.front() == "mode") << fields;
  home.run({"--json", "watch", "--count", "1"});
  EXPECT_FALSE(daemon->newestCall("io.hapticd.Status.Monitor").contains("fields"));
  home.run({"--json", "watch", "--count", "1", "--fields", "mode,loop.rateHz"});
  EXPECT_EQ(daemon->newestCall("io.hapticd.Status.Monitor")["fields"], (json{"mode", "loop.rateHz"}));
}

TEST_F(HapticctlWatch, StatusHasColoursOnATerminalUnlessToldOtherwise) {
  const auto output = [&](std::vector<std::string> arguments, std::vector<std::string> environment) {
    TerminalProgram status(home.command(std::move(arguments)), std::move(environment), 24, 80);
    EXPECT_EQ(status.wait(), exitedWith(0));
    return status.output();
  };
  std::vector<std::string> no_color = kUtf8;
  no_color.emplace_back("NO_COLOR=1");
  EXPECT_TRUE(has(output({"status"}, kUtf8), "\033[32mmode"));
  EXPECT_FALSE(has(output({"status"}, no_color), "\033["));
  EXPECT_FALSE(has(output({"--color=never", "status"}, kUtf8), "\033["));
  EXPECT_TRUE(has(home.run({"--color=always", "status"}).output, "\033[32mmode"));
  EXPECT_FALSE(has(home.run({"status"}).output, "\033["));
}

}  // namespace
}  // namespace hapticd::test
