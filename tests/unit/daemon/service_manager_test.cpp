// SPDX-License-Identifier: Apache-2.0
// The notification protocol over a real socket, as the service manager's end sees it.
#include "daemon/service.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

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

}  // namespace
}  // namespace hapticd::daemon
