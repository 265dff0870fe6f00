// SPDX-License-Identifier: Apache-2.0
// The service manager's end of the notification protocol, parts that hang when the daemon stops, and scripts
// of faults.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "daemon/fault_injector.h"
#include "daemon/journal.h"
#include "daemon/service.h"
#include "daemon/stop_guard.h"
#include "drivers/base/stop_signal.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

using std::chrono::milliseconds;

class ServiceManagerTest : public testing::Test {
 protected:
  ServiceManagerTest() : path_((folder_.path() / "notify").string()) {
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~ServiceManagerTest() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "LISTEN_FDS", "LISTEN_PID"})
      ::unsetenv(name);
    ::close(socket_);
  }

  /// The next message; empty when there is none.
  std::string received() {
    std::array<char, 4096> buffer;
    const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), 0);
    return size > 0 ? std::string(buffer.data(), static_cast<std::size_t>(size)) : std::string();
  }

  void watchEvery(milliseconds period) {
    ::setenv("WATCHDOG_USEC", std::to_string(period.count() * 1000).c_str(), 1);
    ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
  }

  test::TemporaryFolder folder_;
  std::string path_;
  int socket_ = -1;
  const ServiceManager::Clock::time_point start_{std::chrono::hours(1)};
};

TEST_F(ServiceManagerTest, ReportsThatTheDaemonIsReadyReloadsAndStops) {
  ServiceManager manager;
  manager.ready();
  EXPECT_EQ(received(), "READY=1");
  manager.reloading();
  EXPECT_EQ(received().rfind("RELOADING=1\nMONOTONIC_USEC=", 0), 0U);
  manager.stopping();
  EXPECT_EQ(received().rfind("STOPPING=1", 0), 0U);
}

TEST_F(ServiceManagerTest, ReportsAStateOnlyWhenItHasChanged) {
  ServiceManager manager;
  manager.showState("idle");
  EXPECT_EQ(received(), "STATUS=idle");
  manager.showState("idle");
  EXPECT_EQ(received(), "");
  manager.showState("engaged");
  EXPECT_EQ(received(), "STATUS=engaged");
}

TEST_F(ServiceManagerTest, FeedsTheWatchdogFourTimesInItsPeriodWhileTheHeartbeatMoves) {
  watchEvery(milliseconds(2000));
  ServiceManager manager;
  std::uint64_t heartbeat = 0;
  int fed = 0;
  for (int ms = 0; ms < 2000; ms += 5) {
    manager.feedWatchdog(++heartbeat, start_ + milliseconds(ms));
    if (received() == "WATCHDOG=1") ++fed;
  }
  EXPECT_EQ(fed, 4);
}

TEST_F(ServiceManagerTest, DoesNotFeedTheWatchdogWhileTheHeartbeatStands) {
  watchEvery(milliseconds(2000));
  ServiceManager manager;
  manager.feedWatchdog(7, start_);
  EXPECT_EQ(received(), "WATCHDOG=1");
  for (int ms = 5; ms < 10'000; ms += 5) manager.feedWatchdog(7, start_ + milliseconds(ms));
  EXPECT_EQ(received(), "");
  manager.feedWatchdog(8, start_ + milliseconds(10'000));
  EXPECT_EQ(received(), "WATCHDOG=1");
}

/// A service manager that hangs reads nothing: sd_notify() would wait for it.
TEST_F(ServiceManagerTest, NeverWaitsForAFullSocketAndSendsLaterWhatStillMatters) {
  watchEvery(milliseconds(2000));
  ServiceManager manager;
  milliseconds now{0};
  std::uint64_t heartbeat = 0;
  const auto feed = [&] { manager.feedWatchdog(++heartbeat, start_ + (now += milliseconds(500))); };
  // The kernel's queue holds net.unix.max_dgram_qlen messages, some hundreds at most.
  for (int i = 0; i < 5000 && manager.lost() == 0; ++i) feed();
  ASSERT_EQ(manager.lost(), 1U);
  manager.reloading();
  manager.ready();
  manager.showState("idle");
  manager.showState("engaged");
  feed();
  EXPECT_EQ(manager.lost(), 1U) << "the same feed is due still";

  std::vector<std::string> messages;
  const auto take = [&] {
    for (std::string text = received(); !text.empty(); text = received()) messages.push_back(text);
  };
  take();
  messages.clear();
  feed();
  take();
  ASSERT_EQ(messages.size(), 4U);
  EXPECT_TRUE(messages[0].starts_with("RELOADING=1"));
  EXPECT_EQ(messages[1], "READY=1");
  EXPECT_EQ(messages[2], "STATUS=engaged") << "the older one means nothing any more";
  EXPECT_EQ(messages[3], "WATCHDOG=1");
  EXPECT_EQ(manager.lost(), 1U);
}

TEST_F(ServiceManagerTest, SendsToANameInTheAbstractNamespace) {
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path_;  // unique, as the folder is
  name.copy(address.sun_path + 1, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address),
                   static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size())),
            0);
  ::setenv("NOTIFY_SOCKET", ("@" + name).c_str(), 1);
  ServiceManager manager;
  manager.ready();
  EXPECT_EQ(manager.lost(), 0U);
  std::array<char, 64> buffer;
  const ssize_t size = ::recv(socket, buffer.data(), buffer.size(), 0);
  EXPECT_EQ(std::string(buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))), "READY=1");
  ::close(socket);
}

TEST_F(ServiceManagerTest, CountsWhatNobodyCanTake) {
  ::close(socket_);
  socket_ = -1;
  ServiceManager manager;
  manager.ready();
  EXPECT_EQ(manager.lost(), 1U);
}

TEST_F(ServiceManagerTest, LeavesTheWatchdogAloneWhenNobodyWatches) {
  ServiceManager manager;
  manager.feedWatchdog(1, start_);
  EXPECT_EQ(received(), "");
}

TEST_F(ServiceManagerTest, HasNoSocketsWhenNoneWerePassed) {
  ServiceManager manager;
  EXPECT_EQ(manager.takeSocket("status"), -1);
}

constexpr milliseconds kLong = std::chrono::minutes(10);

TEST(StopGuard, LetsAPartStopThatDoes) {
  bool stopped = false;
  stopWithin(
      "the handle", kLong, [&] { stopped = true; },
      [](const std::string& part, milliseconds) { ADD_FAILURE() << part << " was given up"; });
  EXPECT_TRUE(stopped);
}

TEST(StopGuard, GivesAPartUpThatHangs) {
  drivers::StopSignal given_up;
  std::string part;
  stopWithin(
      "the camera", milliseconds(1),
      [&] { EXPECT_TRUE(given_up.waitUntil(std::chrono::steady_clock::now() + std::chrono::minutes(1))); },
      [&](const std::string& name, milliseconds limit) {
        part = name;
        EXPECT_EQ(limit, milliseconds(1));
        given_up.raise();
      });
  EXPECT_EQ(part, "the camera");
}

TEST(StopGuardDeathTest, EndsTheProcessWithoutAPartThatHangs) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto hang = [] {
    drivers::StopSignal never;
    never.waitUntil(std::chrono::steady_clock::now() + kLong);
  };
  EXPECT_EXIT(stopWithin("the camera", milliseconds(1500), hang), testing::ExitedWithCode(EX_SOFTWARE),
              "the camera does not stop within 1.5 s: the daemon ends without it");
}

TEST(StopGuardDeathTest, EndsTheProcessThoughNobodyReadsItsLog) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto end_with_full_pipe = [] {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_NONBLOCK) != 0) return;
    while (::write(ends[1], "x", 1) == 1) continue;
    ::fcntl(ends[1], F_SETFL, 0);
    const auto journal = JournalThread::start();
    ::dup2(ends[1], STDERR_FILENO);
    endWithout("the camera", milliseconds(1500));
  };
  EXPECT_EXIT(end_with_full_pipe(), testing::ExitedWithCode(EX_SOFTWARE), "");
}

TEST(StopLimits, FitIntoWhatTheUnitAllows) {
  std::ifstream unit(HAPTICD_SOURCE_FOLDER "/systemd/hapticd.service.in");
  const std::string key = "TimeoutStopSec=";
  int allowed_s = 0;
  for (std::string line; std::getline(unit, line);) {
    if (line.starts_with(key)) allowed_s = std::stoi(line.substr(key.size()));
  }
  EXPECT_GT(allowed_s, StopLimits::kAll.count());
}

base::Result<std::vector<ScriptedFault>> scriptOf(const std::string& text) {
  const test::TemporaryFolder folder;
  return readFaultScript(folder.write("faults", text));
}

TEST(FaultScript, ReadsTimesAndFaultsAndLeavesOutComments) {
  const auto script = scriptOf("# a tour\n\n 1.5 0.25 nan_pose # first\n2 3 frozen_camera\r\n");
  ASSERT_TRUE(script);
  ASSERT_EQ(script->size(), 2U);
  EXPECT_EQ(script->front().fault, Fault::nan_pose);
  EXPECT_EQ(script->front().begin.count(), 1.5);
  EXPECT_EQ(script->front().duration.count(), 0.25);
  EXPECT_EQ(script->back().fault, Fault::frozen_camera);
}

TEST(FaultScript, KnowsEveryFaultByItsName) {
  for (int number = 0; number < kFaultCount; ++number) {
    const auto fault = static_cast<Fault>(number);
    const auto script = scriptOf("0 1 " + std::string(nameOf(fault)));
    ASSERT_TRUE(script) << nameOf(fault);
    EXPECT_EQ(script->front().fault, fault);
  }
}

TEST(FaultScript, NamesTheLineThatIsWrongAndWhatIsAllowed) {
  for (const char* wrong : {"x 1 nan_pose", "1 nan_pose", "-1 1 nan_pose", "1 inf nan_pose", "1 1e9 nan_pose",
                            "1 1 nan_pose twice"}) {
    const auto script = scriptOf(std::string("0 1 nan_pose\n") + wrong + "\n");
    ASSERT_FALSE(script) << wrong;
    EXPECT_TRUE(script.error().where.ends_with("faults:2")) << script.error().text();
    EXPECT_NE(script.error().what.find(wrong), std::string::npos);
  }
  const auto unknown = scriptOf("1 1 earthquake");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().remedy.find("handle_unplugged"), std::string::npos);
  EXPECT_FALSE(readFaultScript("/nonexistent/faults"));
}

TEST(FaultScript, ShowsWhatIsWrongWithoutEscapeCodesAndCut) {
  for (const std::string& wrong :
       {"\x1b[2J" + std::string(3000, 'x'), "1 1 \x1b[2J" + std::string(3000, 'x')}) {
    const auto script = scriptOf(wrong);
    ASSERT_FALSE(script);
    EXPECT_EQ(script.error().text().find('\x1b'), std::string::npos);
    EXPECT_NE(script.error().what.find("\\x1b[2Jxx"), std::string::npos) << script.error().what;
    EXPECT_LT(script.error().what.size(), 200U);
  }
}

}  // namespace
}  // namespace hapticd::daemon
