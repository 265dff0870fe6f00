// SPDX-License-Identifier: Apache-2.0
// The server under more calls than it can handle, and where the process may open few descriptors.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "config/base/descriptor.h"
#include "control_fixture.h"
#include "daemon/control/server/varlink_connection.h"

namespace hapticd::daemon::test {
namespace {

constexpr std::string_view kCall{"{\"method\":\"a.B\"}"};
constexpr std::string_view kOnewayCall{"{\"method\":\"a.B\",\"oneway\":true}"};
constexpr std::chrono::seconds kPatience{60};

std::string repeated(std::string_view call, int times) {
  std::string calls;
  for (int i = 0; i < times; ++i) calls += message(call);
  return calls;
}

/// The simulated CPU time of the thread, advanced by the handler.
std::atomic<std::int64_t> made_up_time_ns{0};
std::chrono::nanoseconds madeUpTime() {
  return std::chrono::nanoseconds(made_up_time_ns.load());
}

/// Answers every call, records whose call it was, and blocks in a call while the test holds it.
class HeldHandler final : public CallHandler {
 public:
  void handle(const Call&, const Caller& caller, Replies& replies) override {
    {
      std::unique_lock lock(mutex_);
      calls_.push_back(caller);
      changed_.notify_all();
      changed_.wait(lock, [this] { return !held_; });
    }
    made_up_time_ns += cost_ns;
    if (on_call) on_call();
    replies.finish(caller.connection, {});
  }
  void closed(ConnectionId connection) override {
    const std::lock_guard lock(mutex_);
    closed_.push_back(connection);
    changed_.notify_all();
  }

  void hold() {
    const std::lock_guard lock(mutex_);
    held_ = true;
  }
  void release() {
    const std::lock_guard lock(mutex_);
    held_ = false;
    changed_.notify_all();
  }
  bool waitForCalls(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return calls_.size() >= count; });
  }
  bool waitUntilClosed(ConnectionId connection) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience,
                             [&] { return std::ranges::find(closed_, connection) != closed_.end(); });
  }
  std::vector<Caller> calls() const {
    const std::lock_guard lock(mutex_);
    return calls_;
  }

  // CPU time of a call, and what to do at each call; to be set before the server runs.
  std::int64_t cost_ns = 0;
  std::function<void()> on_call;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool held_ = false;
  std::vector<Caller> calls_;
  std::vector<ConnectionId> closed_;
};

class VarlinkServerTurns : public testing::Test {
 protected:
  ~VarlinkServerTurns() override {
    handler.release();
    if (thread_.joinable()) {
      server->requestStop();
      thread_.join();
    }
  }

  void listen() {
    options.listeners = {
        {.access = Access::read, .path = folder.path("Status"), .mode = 0600, .group = "", .descriptor = -1},
        {.access = Access::control,
         .path = folder.path("Control"),
         .mode = 0600,
         .group = "",
         .descriptor = -1}};
  }
  void start() {
    listen();
    options.thread_time = madeUpTime;
    auto created = VarlinkServer::create(options, handler);
    ASSERT_TRUE(created) << created.error().text();
    server = std::move(*created);
    thread_ = std::thread([this] { server->run(std::chrono::milliseconds(2), [this] { onPeriod(); }); });
  }

  /// Returns a client of which one call has been answered.
  RawClient connected(const std::string& socket) {
    RawClient client(folder.path(socket));
    client.call(kCall);
    EXPECT_NE(RawClient::kNoAnswer, client.reply());
    return client;
  }

  /// Waits for another period, so that all calls before it are counted.
  bool waitForAnotherPeriod() const {
    const std::size_t before = periods;
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (periods == before && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
    return periods != before;
  }

  std::size_t readCalls() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        handler.calls(), [](const Caller& caller) { return caller.access == Access::read; }));
  }

  TemporaryFolder folder;
  ServerOptions options;
  HeldHandler handler;
  std::unique_ptr<VarlinkServer> server;
  std::atomic<std::size_t> periods{0};
  std::atomic<std::size_t> most_reads_in_a_period{0};

 private:
  void onPeriod() {
    const std::size_t reads = readCalls();
    ++periods;
    most_reads_in_a_period = std::max(most_reads_in_a_period.load(), reads - reads_before_);
    reads_before_ = reads;
  }

  std::size_t reads_before_ = 0;
  std::thread thread_;
};

TEST_F(VarlinkServerTurns, ConnectionsWithManyCallsWaitingTakeTurns) {
  constexpr int kClients = 5;
  constexpr int kCalls = 50;
  start();
  std::vector<RawClient> clients;
  for (int i = 0; i < kClients; ++i) clients.push_back(connected("Status"));
  handler.hold();
  clients.front().call(kCall);
  ASSERT_TRUE(handler.waitForCalls(kClients + 1));
  for (RawClient& client : clients) client.send(repeated(kCall, kCalls));
  handler.release();
  ASSERT_TRUE(handler.waitForCalls(kClients + 1 + kClients * kCalls));
  std::map<ConnectionId, int> counts;
  int done = 0;
  for (const Caller& caller : handler.calls()) {
    if (++counts[caller.connection] > kCalls) ++done;
    if (counts.size() < kClients || done > 0) continue;
    const auto byCount = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto [least, most] = std::minmax_element(counts.begin(), counts.end(), byCount);
    ASSERT_LE(most->second - least->second, 2);
  }
}

TEST_F(VarlinkServerTurns, ACallForControlPassesTheReadsThatWait) {
  constexpr int kReaders = 39;
  start();
  std::vector<RawClient> readers;
  for (int i = 0; i < kReaders; ++i) readers.push_back(connected("Status"));
  RawClient control = connected("Control");
  handler.hold();
  readers.front().call(kCall);
  ASSERT_TRUE(handler.waitForCalls(kReaders + 2));
  for (RawClient& reader : readers) reader.send(repeated(kOnewayCall, 100));
  control.call(kCall);
  handler.release();
  EXPECT_NE(RawClient::kNoAnswer, control.reply());
  const auto calls = handler.calls();
  const auto held = calls.begin() + kReaders + 1;
  const auto answered =
      std::find_if(held, calls.end(), [](const Caller& caller) { return caller.access == Access::control; });
  ASSERT_NE(answered, calls.end());
  EXPECT_LE(answered - held, 2);  // the held call, and one whose turn it was
}

TEST_F(VarlinkServerTurns, ReadsGetTheirShareOfThePeriodAndAllAreAnswered) {
  constexpr int kReaders = 8;
  constexpr std::size_t kCalls = 20;
  handler.cost_ns = 1'000'000;
  options.read_share = 0.5;  // of 2 ms
  start();
  std::vector<RawClient> readers;
  for (int i = 0; i < kReaders; ++i) {
    readers.emplace_back(folder.path("Status"));
    readers.back().send(repeated(kOnewayCall, kCalls));
  }
  EXPECT_TRUE(handler.waitForCalls(kReaders * kCalls));
  EXPECT_TRUE(waitForAnotherPeriod());
  EXPECT_LE(most_reads_in_a_period, 1U);
}

TEST_F(VarlinkServerTurns, ACallThatTakesLongIsTakenOffThePeriodsBehind) {
  constexpr std::size_t kCalls = 20;
  handler.cost_ns = 5'000'000;
  options.read_share = 0.5;  // of 2 ms
  start();
  RawClient reader(folder.path("Status"));
  reader.send(repeated(kOnewayCall, kCalls));
  EXPECT_TRUE(handler.waitForCalls(kCalls));
  EXPECT_GE(periods, 5 * (kCalls - 1));
}

TEST_F(VarlinkServerTurns, ControlIsNotHeldBackByReadsThatHaveUsedUpTheirTime) {
  handler.cost_ns = std::int64_t{1} << 50;  // ten days
  start();
  RawClient control(folder.path("Control"));
  RawClient reader(folder.path("Status"));
  reader.send(repeated(kCall, 2));
  EXPECT_NE(RawClient::kNoAnswer, reader.reply());
  for (int i = 0; i < 10; ++i) {
    control.call(kCall);
    EXPECT_NE(RawClient::kNoAnswer, control.reply());
  }
  EXPECT_EQ(1U, readCalls());
}

TEST_F(VarlinkServerTurns, TheRequestToStopPassesAllCallsThatWait) {
  for (const char* socket : {"Status", "Control"}) {
    HeldHandler stopping;
    std::unique_ptr<VarlinkServer> stopped;
    listen();
    auto created = VarlinkServer::create(options, stopping);
    ASSERT_TRUE(created) << created.error().text();
    stopped = std::move(*created);
    stopping.on_call = [&] { stopped->requestStop(); };
    RawClient client(folder.path(socket));
    client.send(repeated(kOnewayCall, 1000));
    stopped->run(std::chrono::milliseconds(2), [] {});
    EXPECT_EQ(1U, stopping.calls().size()) << socket;
  }
}

TEST_F(VarlinkServerTurns, ThePeriodIsTheIdleOneWhileNobodyIsConnected) {
  options.idle_period = std::chrono::hours(1);
  start();
  EXPECT_EQ(0U, periods);
  RawClient client = connected("Status");
  EXPECT_TRUE(waitForAnotherPeriod());
  EXPECT_TRUE(waitForAnotherPeriod());
  client.close();
  ASSERT_TRUE(handler.waitUntilClosed(handler.calls().front().connection));
  EXPECT_TRUE(waitForAnotherPeriod()) << "the period that had begun ends";
  connected("Control");
  EXPECT_TRUE(waitForAnotherPeriod());
}

TEST_F(VarlinkServerTurns, NothingIsDoneForAReaderThatHasLeft) {
  start();
  RawClient reader = connected("Status");
  handler.hold();
  reader.call(kOnewayCall);
  ASSERT_TRUE(handler.waitForCalls(2));
  reader.send(repeated(kOnewayCall, 2000));
  reader.close();
  handler.release();
  ASSERT_TRUE(handler.waitUntilClosed(handler.calls().front().connection));
  EXPECT_LE(handler.calls().size(), 3U);  // one more whose turn it may have been
}

// The control API where the process may open few descriptors, beside a user who takes all that he can get.

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
