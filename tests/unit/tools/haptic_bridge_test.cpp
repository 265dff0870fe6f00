// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "rt/base/clock.h"
#include "tests/support/program.h"
#include "tools/lib/bridge/bridge.h"
#include "tools/lib/bridge/device.h"

// The bridge with a real socket, and a log whose disk stalls: a pipe that nobody reads.
namespace hapticd::tools {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(BoundedForce, KeepsTheDirectionAndCutsTheLength) {
  EXPECT_EQ(boundedForce({3, 0, 4}, 10), (rt::Vec3{3, 0, 4}));
  EXPECT_EQ(boundedForce({3, 0, 4}, 5), (rt::Vec3{3, 0, 4}));
  const rt::Vec3 cut = boundedForce({30, 0, -40}, 5);
  EXPECT_DOUBLE_EQ(cut.x, 3);
  EXPECT_EQ(cut.y, 0);
  EXPECT_DOUBLE_EQ(cut.z, -4);
}

TEST(BoundedForce, IsNoneWhereTheForceOrTheLimitIsNoFiniteNumber) {
  for (const double bad : {kNan, -kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(boundedForce({3, 0, 4}, bad), rt::Vec3{}) << "limit " << bad;
    EXPECT_EQ(boundedForce({bad, 0, 0}, 5), rt::Vec3{}) << "x " << bad;
    EXPECT_EQ(boundedForce({0, bad, 0}, 5), rt::Vec3{}) << "y " << bad;
    EXPECT_EQ(boundedForce({1, 1, bad}, 5), rt::Vec3{}) << "z " << bad;
  }
  EXPECT_EQ(boundedForce({1e300, 1e300, 0}, 5), rt::Vec3{}) << "its length is beyond all numbers";
  EXPECT_EQ(boundedForce({1, 0, 0}, 0), rt::Vec3{});
  EXPECT_EQ(boundedForce({1, 0, 0}, -1), rt::Vec3{});
}

TEST(DampedForce, IsLessOnTheWayOutMoreOnTheWayInAndNeverPulls) {
  const rt::Vec3 force{0, 0, 4};
  EXPECT_EQ(dampedForce(force, {0, 0, 0.1}, 5), (rt::Vec3{0, 0, 3.5}));
  EXPECT_EQ(dampedForce(force, {0, 0, -0.1}, 5), (rt::Vec3{0, 0, 4.5}));
  EXPECT_EQ(dampedForce(force, {3, -2, 0}, 5), force) << "nothing along the surface";
  EXPECT_EQ(dampedForce(force, {0, 0, 1}, 5), rt::Vec3{});
  EXPECT_EQ(dampedForce({}, {0, 0, 1}, 5), rt::Vec3{}) << "no contact, no damping";
  EXPECT_EQ(boundedForce(dampedForce(force, {0, 0, kNan}, 5), 10), rt::Vec3{});
}

using drivers::udp::Conversation;
using drivers::udp::UdpSocket;
using test::becomesTrue;

/// A stream whose writer waits until resume() is called.
class StalledStream {
 public:
  StalledStream() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    read_end_ = ends[0];
    ::fcntl(ends[1], F_SETFL, O_NONBLOCK);
    const std::string page(4096, '-');
    for (ssize_t count = 0; (count = ::write(ends[1], page.data(), page.size())) > 0;)
      filled_ += static_cast<std::size_t>(count);
    ::fcntl(ends[1], F_SETFL, 0);
    stream_ = ::fdopen(ends[1], "w");
  }
  ~StalledStream() {
    if (!reader_.joinable()) resume();
    reader_.join();
    ::close(read_end_);
  }
  StalledStream(const StalledStream&) = delete;
  StalledStream& operator=(const StalledStream&) = delete;

  /// The log closes it.
  std::FILE* stream() const { return stream_; }
  /// Reads to the end from now on.
  void resume() {
    reader_ = std::thread([this] {
      std::array<char, 65536> buffer{};
      for (ssize_t count = 0; (count = ::read(read_end_, buffer.data(), buffer.size())) > 0;)
        content_.append(buffer.data(), static_cast<std::size_t>(count));
    });
  }
  /// What was written, once the log has closed the stream.
  std::string content() {
    reader_.join();
    reader_ = std::thread([] {});
    return content_.substr(filled_);
  }

 private:
  int read_end_ = -1;
  std::size_t filled_ = 0;
  std::FILE* stream_ = nullptr;
  std::thread reader_;
  std::string content_;
};

/// A device that stands still, and what it exerts.
class StandingDevice final : public Device {
 public:
  DeviceReading read() override { return {}; }
  void exert(const DeviceCommand& command) override { exerted_n_ = norm(command.force_n); }
  DeviceLimits limits() const override { return {.force_n = 10}; }
  double exerted_n() const { return exerted_n_; }

 private:
  std::atomic<double> exerted_n_ = 0;
};

/// The side of hapticd: answers states with a force.
class Commander {
 public:
  Commander() : socket_(std::move(*UdpSocket::boundTo(loopback()))) {}

  static drivers::Ipv4Endpoint loopback() { return *drivers::ipv4EndpointFrom("127.0.0.1"); }
  static drivers::Ipv4Endpoint endpointOf(const UdpSocket& socket) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    ::getsockname(socket.descriptor(), reinterpret_cast<sockaddr*>(&address), &size);
    drivers::Ipv4Endpoint endpoint = loopback();
    endpoint.port = ntohs(address.sin_port);
    return endpoint;
  }
  drivers::Ipv4Endpoint endpoint() const { return endpointOf(socket_); }

  /// Takes the states that have arrived and commands 2 N.
  void command(const drivers::Ipv4Endpoint& bridge) {
    std::array<std::byte, 256> buffer;
    const std::int64_t now_ns = rt::monotonicNow_ns();
    drivers::udp::CommandPacket packet;
    packet.force_n_in_handle = {0, 0, 2};
    packet.active = true;
    bool greeted = false;
    while (const auto datagram = socket_.receive(buffer)) {
      const auto state = drivers::udp::decodeState(datagram->bytes, {});
      if (!state) continue;
      const Conversation::Verdict verdict = conversation_.hear(state->header, now_ns);
      greeted = verdict == Conversation::Verdict::greeting || verdict == Conversation::Verdict::unproven;
      if (greeted) packet.header = conversation_.answerTo(state->header, now_ns);
    }
    if (!greeted) packet.header = conversation_.next(now_ns);
    socket_.send(drivers::udp::encode(packet, {}).bytes(), bridge);
  }

 private:
  UdpSocket socket_;
  Conversation conversation_;
};

/// A bridge that runs in a thread of its own.
class RunningBridge {
 public:
  explicit RunningBridge(DeviceLog* log = nullptr) : socket_(*UdpSocket::boundTo(Commander::loopback())) {
    BridgeOptions options;
    options.peer = commander_.endpoint();
    bridge_ = std::make_unique<Bridge>(options, socket_, device_, log);
    thread_ = std::thread([this] { bridge_->run([this](double) { return ends_.load(); }); });
  }
  ~RunningBridge() { end(); }
  RunningBridge(const RunningBridge&) = delete;
  RunningBridge& operator=(const RunningBridge&) = delete;

  void command() { commander_.command(Commander::endpointOf(socket_)); }
  double exerted_n() const { return device_.exerted_n(); }
  /// Ends the loop; the bridge stays.
  void end() {
    ends_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  StandingDevice device_;
  Commander commander_;
  UdpSocket socket_;
  std::unique_ptr<Bridge> bridge_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

std::vector<std::string> linesOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(HapticBridge, LetsGoOfTheHandWhileTheDiskOfItsLogStalls) {
  StalledStream disk;
  auto log = DeviceLog::into(disk.stream(), "log.csv");
  ASSERT_TRUE(log);
  RunningBridge bridge(log->get());
  int commands = 0;  // one each 5 ms, so that rows come that no buffer can hold back
  EXPECT_TRUE(becomesTrue([&] {
    bridge.command();
    return ++commands > 100 && bridge.exerted_n() > 1;
  }));
  EXPECT_TRUE(becomesTrue([&] { return bridge.exerted_n() == 0; })) << "no commands come any more";
  disk.resume();
  bridge.end();
  EXPECT_TRUE((*log)->finish());
  EXPECT_EQ((*log)->dropped(), 0U);
}

TEST(HapticBridge, HasLetGoOfTheHandWhenItsLoopHasEnded) {
  RunningBridge bridge;
  std::atomic<bool> ended = false;
  ASSERT_TRUE(becomesTrue([&] {
    bridge.command();
    return bridge.exerted_n() > 1;
  }));
  std::thread commands([&] {
    while (!ended) bridge.command();
  });
  bridge.end();
  EXPECT_EQ(bridge.exerted_n(), 0) << "what is printed and written after it may take long";
  ended = true;
  commands.join();
}

TEST(DeviceLog, WritesOrCountsEveryRowOfAStalledDisk) {
  StalledStream disk;
  auto log = DeviceLog::into(disk.stream(), "log.csv");
  ASSERT_TRUE(log);
  constexpr std::size_t kAdded = 3 * DeviceLog::kWaitingRows;
  DeviceTick tick;
  while (tick.time_ns < static_cast<std::int64_t>(kAdded)) {
    ++tick.time_ns;
    (*log)->add(tick);
  }
  const std::uint64_t dropped = (*log)->dropped();
  EXPECT_GE(dropped, DeviceLog::kWaitingRows) << "more than may wait";
  disk.resume();
  ASSERT_TRUE((*log)->finish());

  const std::vector<std::string> lines = linesOf(disk.content());
  EXPECT_EQ(lines.size(), 1 + kAdded - dropped) << "the first line names the columns";
  std::int64_t before = 0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::int64_t time_ns = std::stoll(lines[i]);
    EXPECT_EQ(time_ns, before + 1) << "the oldest rows stay, in order";
    before = time_ns;
  }
}

}  // namespace
}  // namespace hapticd::tools
