// SPDX-License-Identifier: Apache-2.0
// The notification protocol over a real socket, as the service manager's end sees it.
#include "daemon/service_manager.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>

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
