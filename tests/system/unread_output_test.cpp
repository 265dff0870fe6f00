// SPDX-License-Identifier: Apache-2.0
// Whatever another process leaves unread or a disk leaves undone: the daemon answers, ends the force, feeds
// the watchdog and loses no tick.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <list>
#include <stdexcept>

#include "config/base/descriptor.h"
#include "tests/support/disk_stall.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/terminal_program.h"
#include "tests/system/support/test_sockets.h"

namespace hapticd {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::becomesTrue;
using test::boundSocket;
using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::isTold;

/// A pipe whose reader does not read.
class UnreadPipe {
 public:
  UnreadPipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    reader_ = base::Descriptor(ends[0]);
    writer_ = base::Descriptor(ends[1]);
  }
  int writer() const { return writer_.get(); }

  /// Fills it to the last byte, through a descriptor of its own: O_NONBLOCK is shared by all copies of one.
  void fill() const {
    const base::Descriptor own(::open(path(writer_).c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC));
    for (const std::size_t size : {4096U, 1U}) {
      const std::string block(size, 'x');
      while (::write(own.get(), block.data(), block.size()) > 0) continue;
    }
  }

  /// Reads all that is there.
  std::string content() const {
    const base::Descriptor own(::open(path(reader_).c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    std::string text;
    std::array<char, 65536> chunk;
    for (ssize_t count = 0; (count = ::read(own.get(), chunk.data(), chunk.size())) > 0;)
      text.append(chunk.data(), static_cast<std::size_t>(count));
    return text;
  }

 private:
  static std::string path(const base::Descriptor& descriptor) {
    return "/proc/self/fd/" + std::to_string(descriptor.get());
  }

  base::Descriptor reader_;
  base::Descriptor writer_;
};

/// "device:inode" of an open file, as in JOURNAL_STREAM.
std::string identityOf(int descriptor) {
  struct stat file {};
  EXPECT_EQ(::fstat(descriptor, &file), 0);
  return std::to_string(file.st_dev) + ":" + std::to_string(file.st_ino);
}

class UnreadOutput : public testing::Test {
 protected:
  std::vector<std::string> command() const {
    return home_.command(test::kWallYaml, {"control.engage_at_start=true"});
  }
  std::vector<std::string> environment() const {
    return {"NOTIFY_SOCKET=" + (home_.path() / "notify").string(), "WATCHDOG_USEC=400000"};
  }
  /// Waits until the daemon presses.
  bool presses() const {
    return becomesTrue([this] {
      if (!fs::exists(home_.controlSocket())) return false;
      const json now = status();
      return now.is_object() && now.at("mode") == "engaged" &&
             test::lengthOf(now.at("tick").at("commandForceNInWorld")) > 0.1;
    });
  }
  /// Null if it does not answer.
  json status() const {
    const test::Finished reply = home_.control({"--json", "status"});
    return reply.ending == exitedWith(0) ? json::parse(reply.output).at("status") : json();
  }
  bool setsStiffness(int value) const {
    return home_.control({"set", "force.stiffness_n_per_m=" + std::to_string(value)}).ending == exitedWith(0);
  }
  /// Changes, and therefore logs, that many times; false as soon as the daemon does not answer.
  bool changes(int times) const {
    for (int i = 0; i < times; ++i) {
      if (!setsStiffness(300 + i)) return false;
    }
    return true;
  }
  std::uint64_t counted(const char* counter) const { return status().at("control").at(counter); }
  /// Changes until the counter moves.
  bool countsLosses(const char* counter) const {
    return becomesTrue([&] { return setsStiffness(400) && setsStiffness(401) && counted(counter) > 0; });
  }
  bool feedsWatchdog() const {
    for (int time = 0; time < 3; ++time) {
      if (!isTold(manager_, "WATCHDOG=1")) return false;
    }
    return true;
  }
  void expectForceEnds() const {
    EXPECT_EQ(home_.control({"disengage"}).ending, exitedWith(0));
    const json now = status();
    ASSERT_TRUE(now.is_object());
    EXPECT_EQ(now.at("mode"), "idle");
    EXPECT_EQ(now.at("control").at("ticksLost"), 0);
  }
  bool endsToWarn(const std::string& text) const {
    return becomesTrue([&] { return status().at("warnings").dump().find(text) == std::string::npos; });
  }
  bool warns(const std::string& text) const {
    return becomesTrue([&] { return status().at("warnings").dump().find(text) != std::string::npos; });
  }

  const DaemonHome home_;
  const base::Descriptor manager_ = boundSocket(SOCK_DGRAM, home_.path() / "notify");
};

TEST_F(UnreadOutput, AFullPipeBehindStandardErrorHoldsNothingUp) {
  const UnreadPipe pipe;
  Daemon daemon(home_, command(), {.environment = environment(), .stderr_to = pipe.writer()});
  ASSERT_TRUE(presses());
  pipe.fill();
  ASSERT_TRUE(changes(10));
  EXPECT_TRUE(feedsWatchdog());
  EXPECT_TRUE(warns("the log has not been read for"));
  ASSERT_TRUE(countsLosses("logEntriesLost"));
  expectForceEnds();

  std::string text;
  EXPECT_TRUE(becomesTrue([&] {
    text += pipe.content();
    return text.find("log entries are missing here") != std::string::npos;
  })) << text;
  EXPECT_TRUE(contains(text, "sets force.stiffness_n_per_m from 300 to 301"));
  pipe.fill();
  ASSERT_TRUE(changes(2));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST_F(UnreadOutput, AStoppedTerminalHoldsNothingUp) {
  test::TerminalProgram daemon(command(), environment(), 24, 80);
  ASSERT_TRUE(presses());
  daemon.press('\x13');  // Ctrl-S
  ASSERT_TRUE(changes(10));
  EXPECT_TRUE(feedsWatchdog());
  EXPECT_TRUE(warns("the log has not been read for"));
  expectForceEnds();
  EXPECT_EQ(daemon.output().find("disengages"), std::string::npos) << "the terminal does not print";
  daemon.press('\x11');  // Ctrl-Q
  EXPECT_TRUE(daemon.prints("disengages"));
  EXPECT_TRUE(endsToWarn("the log has not been read for")) << status().at("warnings");
  daemon.press('\x13');
  ASSERT_TRUE(changes(2));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), exitedWith(0));
}

// The kernel would stop the whole process, with the force that it commands.
TEST_F(UnreadOutput, ATerminalThatForbidsOutputOfBackgroundJobsDoesNotStopTheDaemon) {
  // A job in the background has a process group of its own, which would outlive the shell.
  std::vector<std::string> words{
      "/bin/sh", "-c", "stty tostop && set -m && { /usr/bin/setpriv --pdeathsig KILL \"$@\" & } && wait",
      "sh"};
  for (const std::string& word : command()) words.push_back(word);
  std::vector<std::string> variables = environment();
  variables.emplace_back("PATH=/usr/bin:/bin");
  test::TerminalProgram shell(words, variables, 24, 80);
  ASSERT_TRUE(presses()) << shell.output();
  ASSERT_TRUE(changes(3));
  expectForceEnds();
  EXPECT_TRUE(shell.prints("disengages"));
}

TEST_F(UnreadOutput, AJournalThatHangsHoldsNothingUp) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root for a journal socket in a mount namespace of its own";
  const fs::path run = home_.path() / "run";
  fs::create_directories(run / "systemd" / "journal");
  const base::Descriptor journal = boundSocket(SOCK_DGRAM, run / "systemd" / "journal" / "socket");
  const UnreadPipe pipe;
  std::vector<std::string> in_namespace{
      "/usr/bin/unshare", "--mount", "/bin/sh", "-c", "mount --bind \"$0\" /run && exec \"$@\"",
      run.string()};
  for (const std::string& word : command()) in_namespace.push_back(word);
  std::vector<std::string> variables = environment();
  variables.push_back("JOURNAL_STREAM=" + identityOf(pipe.writer()));
  Daemon daemon(home_, in_namespace, {.environment = variables, .stderr_to = pipe.writer()});
  if (!becomesTrue([&] { return !daemon.running() || fs::exists(home_.controlSocket()); }) ||
      !daemon.running()) {
    GTEST_SKIP() << "no mount namespace here: " << pipe.content();
  }
  ASSERT_TRUE(presses());
  ASSERT_TRUE(isTold(journal, "MESSAGE=")) << "it does not log there";
  test::fillQueue(run / "systemd" / "journal" / "socket");
  ASSERT_TRUE(changes(10));
  EXPECT_TRUE(feedsWatchdog());
  EXPECT_TRUE(warns("the log has not been read for"));
  expectForceEnds();
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST_F(UnreadOutput, AServiceManagerThatHangsHoldsNothingUpAndIsNotifiedLater) {
  Daemon daemon(home_, command(), {.environment = environment()});
  ASSERT_TRUE(presses());
  test::fillQueue(home_.path() / "notify");
  ASSERT_TRUE(becomesTrue([this] { return counted("notificationsLost") > 0; }));
  ASSERT_TRUE(changes(3));
  daemon.signal(SIGHUP);
  ASSERT_TRUE(becomesTrue([&] { return daemon.errors().find("reloaded") != std::string::npos; }));
  expectForceEnds();
  EXPECT_TRUE(isTold(manager_, "RELOADING=1"));
  EXPECT_TRUE(isTold(manager_, "READY=1"));
  EXPECT_TRUE(feedsWatchdog());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST_F(UnreadOutput, ClientsThatDoNotReadHoldNothingUp) {
  Daemon daemon(home_, command(), {.environment = environment()});
  ASSERT_TRUE(presses());
  const auto call = [](const std::string& method, const std::string& flags) {
    return "{\"method\":\"" + method + "\"" + flags + "}" + '\0';
  };
  std::list<test::Client> clients;
  for (int i = 0; i < 10; ++i) {
    clients.emplace_back(home_.statusSocket())
        .send(call("io.hapticd.Status.Ticks", ",\"parameters\":{\"fields\":[\"number\"]},\"more\":true"));
    clients.emplace_back(home_.statusSocket()).send(call("io.hapticd.Status.Monitor", ",\"more\":true"));
    test::Client& pipelining = clients.emplace_back(home_.controlSocket());
    for (int j = 0; j < 200; ++j) pipelining.sendSome(call("io.hapticd.Status.GetParameters", ""));
    clients.emplace_back(home_.controlSocket()).send("{\"method\":");
  }
  ASSERT_TRUE(changes(10));
  EXPECT_TRUE(feedsWatchdog());
  expectForceEnds();
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

/// From the start, when the folder is listed for the first time, or while a trace is written.
class StalledDisk : public UnreadOutput, public testing::WithParamInterface<bool> {};

TEST_P(StalledDisk, HoldsNothingUp) {
  test::DiskStall disk(home_.traceFolder());
  fs::create_directories(home_.traceFolder());
  if (GetParam()) disk.begin();
  std::vector<std::string> words = command();
  words.push_back("--set=trace.at_start=true");
  Daemon daemon(home_, words, {.environment = environment(), .disk = &disk});
  if (!daemon.stallable()) GTEST_SKIP() << "this kernel does not let a test hold up system calls";
  ASSERT_TRUE(presses());
  disk.begin();
  ASSERT_TRUE(becomesTrue([&] { return disk.waiting() > 0; })) << "it does not reach for its disk";
  ASSERT_TRUE(changes(10));
  EXPECT_TRUE(feedsWatchdog());
  EXPECT_TRUE(warns("the disk has not answered for"));
  expectForceEnds();
  disk.end();
  EXPECT_TRUE(becomesTrue([this] { return status().at("trace").at("state") == "writing"; }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

INSTANTIATE_TEST_SUITE_P(When, StalledDisk, testing::Bool(), [](const auto& instance) {
  return std::string(instance.param ? "FromTheStart" : "WhileATraceIsWritten");
});

}  // namespace
}  // namespace hapticd
