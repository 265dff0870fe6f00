// SPDX-License-Identifier: Apache-2.0
// The control API where the process may open few descriptors, beside a user who takes all that he can get.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "config/base/descriptor.h"
#include "control_fixture.h"
#include "daemon/control/server/varlink_connection.h"

namespace hapticd::daemon::test {
namespace {

constexpr uid_t kStranger = 65534;
constexpr const char* kGetStatus = R"({"method":"io.hapticd.Status.GetStatus"})";

int unixSocket() {
  return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
}

rlimit descriptorLimit() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  return limit;
}

/// Lets this process open so many descriptors more, and no others, while the object lives.
class FewDescriptors {
 public:
  explicit FewDescriptors(std::size_t more) : before_(descriptorLimit()) {
    const std::size_t open = before_.rlim_cur - freeDescriptors();
    rlimit limit = before_;
    limit.rlim_cur = open + more;
    ::setrlimit(RLIMIT_NOFILE, &limit);
  }
  ~FewDescriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  FewDescriptors(const FewDescriptors&) = delete;
  FewDescriptors& operator=(const FewDescriptors&) = delete;

 private:
  rlimit before_;
};

/// Another user, who keeps as many connections to a socket as he gets. He exists from the start on, so that
/// his descriptors are none of this process.
class Greedy {
 public:
  Greedy(const std::string& path, int connections) {
    if (::pipe2(begin_.data(), O_CLOEXEC) != 0 || ::pipe2(result_.data(), O_CLOEXEC) != 0) ::abort();
    child_ = ::fork();
    if (child_ == 0) connect(path, connections);
  }
  ~Greedy() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    for (const int end : {begin_[0], begin_[1], result_[0], result_[1]}) ::close(end);
  }
  Greedy(const Greedy&) = delete;
  Greedy& operator=(const Greedy&) = delete;

  /// Begins, and returns how many connections were answered.
  int take() {
    [[maybe_unused]] const ssize_t written = ::write(begin_[1], "x", 1);
    int answered = -1;
    [[maybe_unused]] const ssize_t got = ::read(result_[0], &answered, sizeof answered);
    return answered;
  }

 private:
  void connect(const std::string& path, int connections) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    char go = 0;
    if (::setuid(kStranger) != 0 || ::read(begin_[0], &go, 1) != 1) ::_exit(1);
    std::vector<RawClient> clients;
    for (int i = 0;; ++i) {
      RawClient client(path);
      client.call(kGetStatus);
      if (!client.json().contains("error")) clients.push_back(std::move(client));
      if (i != connections) continue;
      const auto answered = static_cast<int>(clients.size());
      [[maybe_unused]] const ssize_t written = ::write(result_[1], &answered, sizeof answered);
    }
  }

  std::array<int, 2> begin_{};
  std::array<int, 2> result_{};
  pid_t child_ = -1;
};

class DescriptorLimits : public ControlFixture {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "needs root to connect as another user";
    std::filesystem::permissions(folder.path(""), std::filesystem::perms(0711));
  }
};

TEST_F(DescriptorLimits, LeaveConnectionsToThoseWhoMayControlAndNewOnesToOthers) {
  Greedy greedy(statusPath(), 60);
  const std::array<int, 3> sockets{unixSocket(), unixSocket(), unixSocket()};
  start();
  const FewDescriptors limited(12);
  const int answered = greedy.take();
  EXPECT_GE(answered, 12) << "all that there were";

  RawClient control = RawClient::adopt(sockets[0], controlPath());
  control.call(kGetStatus);
  EXPECT_TRUE(control.json()["parameters"]["status"].is_object());
  RawClient second = RawClient::adopt(sockets[1], controlPath());
  second.call(R"({"method":"io.hapticd.Control.Disengage"})");
  EXPECT_FALSE(second.json().contains("error"));
  RawClient reader = RawClient::adopt(sockets[2], statusPath());
  reader.call(kGetStatus);
  EXPECT_TRUE(reader.json()["parameters"]["status"].is_object());
}

TEST_F(DescriptorLimits, GiveWhatBecomesFreeToTheReserveFirst) {
  Greedy greedy(statusPath(), 30);
  std::array<int, 50> sockets{};
  std::ranges::generate(sockets, unixSocket);
  start();
  const FewDescriptors limited(12);
  EXPECT_GE(greedy.take(), 12);
  std::vector<RawClient> clients;  // whose own descriptors stay in use
  for (const int socket : sockets) {
    RawClient& control = clients.emplace_back(RawClient::adopt(socket, controlPath()));
    control.call(kGetStatus);
    ASSERT_TRUE(control.json()["parameters"]["status"].is_object()) << clients.size();
    control.endInput();
    ASSERT_EQ(control.reply(), RawClient::kClosed);
  }
}

TEST_F(DescriptorLimits, LeaveDescriptorsToFilesBesideAllConnectionsOfAUser) {
  Greedy greedy(statusPath(), 60);
  const FewDescriptors limited(90);
  start();
  const int answered = greedy.take();
  EXPECT_GT(answered, 0);
  EXPECT_LT(answered, 20);
  std::vector<base::Descriptor> files;
  for (int i = 0; i < 40; ++i) {
    files.emplace_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    ASSERT_TRUE(files.back()) << i;
  }
}

/// The fewer descriptors, the fewer connections; what is left to files never falls below its share before the
/// least numbers of connections are reached, and no user has all places.
TEST(ServerLimitsWithin, FollowTheDescriptors) {
  const ServerLimits most{{48, 40}, {32, 24}, 32};
  const auto sumOf = [](const ServerLimits& limits) {
    return limits.read.all + limits.control.all + limits.lingering;
  };
  std::size_t before = 0;
  for (std::size_t descriptors = 0; descriptors < 400; ++descriptors) {
    const ServerLimits limits = limitsWithin(most, descriptors);
    EXPECT_GE(sumOf(limits), before) << descriptors;
    before = sumOf(limits);
    EXPECT_TRUE(sumOf(limits) <= 12 || sumOf(limits) + 48 <= descriptors) << descriptors;
    for (const ConnectionLimits& one : {limits.read, limits.control}) {
      EXPECT_GE(one.per_user, 1U);
      EXPECT_LT(one.per_user, one.all);
    }
    EXPECT_LE(limits.read.per_user, most.read.per_user);
    EXPECT_LE(limits.control.per_user, most.control.per_user);
  }
  EXPECT_EQ(sumOf(limitsWithin(most, 1024)), sumOf(most));
  EXPECT_EQ(limitsWithin(most, 1024).read.per_user, most.read.per_user);
}

}  // namespace
}  // namespace hapticd::daemon::test
