// SPDX-License-Identifier: Apache-2.0
// Programs that say "this computer" are bound to it, and what is sent to their ports from another computer
// does not reach them: two networks of the test's own, which end with its process.
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/base/descriptor.h"
#include "daemon/trace/ros/message_set.h"
#include "ros_messages.h"
#include "rt/base/clock.h"
#include "tests/ros/ros_listener.h"
#include "tests/system/support/daemon_under_test.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::test {
namespace {

constexpr const char* kBox = "10.77.0.1";     // of the box at box0, to which the intruder has a cable
constexpr const char* kBehind = "10.78.0.1";  // of the box at behind0, which has no cable to the intruder

void run(const std::string& command) {
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

/// What a program has bound, as ss shows it.
struct BoundSocket {
  bool is_tcp = false;
  std::string address;
  int port = 0;

  bool isOfThisComputer() const {
    return address.starts_with("127.") || address == "[::1]" || address.ends_with("%lo");
  }
};

std::vector<BoundSocket> socketsOf(const Program& program) {
  std::istringstream lines(runToEnd({"/usr/bin/ss", "-Hanutp"}).output);
  std::vector<BoundSocket> all;
  for (std::string line; std::getline(lines, line);) {
    if (!line.contains(fmt::format("pid={},", program.pid()))) continue;
    std::istringstream words(line);
    std::string kind, state, received, sent, local;
    words >> kind >> state >> received >> sent >> local;
    const std::size_t colon = local.rfind(':');
    all.push_back({kind == "tcp", local.substr(0, colon), std::atoi(local.c_str() + colon + 1)});
  }
  return all;
}

/// Sends bytes to a UDP port, or asks for a connection to a TCP port. Returns the socket; with errno, if that
/// is refused at once.
base::Descriptor sent(const BoundSocket& to, const char* computer, const std::string& bytes) {
  base::Descriptor socket(::socket(AF_INET, (to.is_tcp ? SOCK_STREAM : SOCK_DGRAM) | SOCK_CLOEXEC, 0));
  const timeval patience{0, 200'000};
  ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(to.port));
  ::inet_pton(AF_INET, computer, &address.sin_addr);
  errno = 0;
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    (void)::send(socket.get(), bytes.data(), bytes.size(), 0);
  return socket;
}

/// Whether the computer says that nobody takes what is sent there.
bool isRefused(const BoundSocket& to, const char* computer) {
  char answer = 0;
  const base::Descriptor socket = sent(to, computer, "?");
  return errno == ECONNREFUSED || (::recv(socket.get(), &answer, 1, 0) < 0 && errno == ECONNREFUSED);
}

class ThisComputer : public ::testing::Test {
 protected:
  void SetUp() override {
    if (::unshare(CLONE_NEWNET) != 0)
      GTEST_SKIP()
          << "NOT SHOWN: network namespaces are not permitted here, so what another computer can reach";
    box_ = base::Descriptor(::open("/proc/thread-self/ns/net", O_RDONLY));
    run("ip link set lo up");
    run("ip link add box0 type veth peer name outside0");
    run("ip link add behind0 type veth peer name behind1");
    run(fmt::format("ip address add {}/24 dev box0 && ip link set box0 up", kBox));
    run(fmt::format("ip address add {}/24 dev behind0 && ip link set behind0 up && ip link set behind1 up",
                    kBehind));
    // so that each refusal is told at once; where that cannot be set it is asked for again
    run("(echo 0 > /proc/sys/net/ipv4/icmp_ratelimit) 2>/dev/null || true");
    ASSERT_EQ(::unshare(CLONE_NEWNET), 0);
    outside_ = base::Descriptor(::open("/proc/thread-self/ns/net", O_RDONLY));
    run(fmt::format("nsenter --net=/proc/{0}/fd/{1} ip link set outside0 netns {0}", ::getpid(), box_.get()));
    run("ip link set lo up && ip address add 10.77.0.2/24 dev outside0 && ip link set outside0 up");
    run("ip route add 10.78.0.0/24 via 10.77.0.1 && ip route add 239.0.0.0/8 dev outside0");
    enter(box_);
  }
  /// What this thread does from now on, and what it starts, is there.
  void enter(const base::Descriptor& network) { ASSERT_EQ(::setns(network.get(), CLONE_NEWNET), 0); }

  std::vector<std::string> ros(const std::string& name_space, const std::vector<std::string>& more) const {
    std::vector<std::string> all{HAPTICD_ROS_PROGRAM,
                                 "--socket",
                                 home_.statusSocket(),
                                 "--control-socket",
                                 home_.controlSocket(),
                                 "--namespace",
                                 name_space,
                                 "--take",
                                 "servo_cf"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  DaemonHome home_;
  base::Descriptor box_;
  base::Descriptor outside_;
};

TEST_F(ThisComputer, IsWhereEverySocketIsBoundAndNobodyElseReachesOne) {
  const std::string page = home_.write("index.html", "");
  struct Case {
    std::vector<std::string> command;
    std::size_t sockets;
  };
  const std::vector<Case> cases{
      {home_.command("handle: {driver: udp}\nudp_handle: {peer: 127.0.0.1}\ncamera: {driver: synthetic}\n"),
       1},
      {{HAPTICD_VIEW_PROGRAM, "--socket", home_.statusSocket(), "--page", home_.path().string(),
        "--token-file", (home_.path() / "token").string()},
       1},
      {{HAPTIC_BRIDGE_PROGRAM, "--peer", "127.0.0.1:47800"}, 1},
      {{HAPTIC_BRIDGE_PROGRAM, "force-dimension", "--peer", "127.0.0.1:47800"}, 1},
      {ros("box", {"--take", "state_command"}), 5},
      {{HAPTIC_CRTK_BRIDGE_PROGRAM, "--arm", "arm", "--peer", "127.0.0.1:47800"}, 6}};
  for (const Case& one : cases) {
    enter(box_);
    const Program program(one.command);
    std::vector<BoundSocket> sockets;
    EXPECT_TRUE(becomesTrue([&] {
      sockets = socketsOf(program);
      return sockets.size() >= one.sockets;
    })) << one.command.front()
        << ": " << sockets.size() << " sockets\n"
        << program.errors();
    enter(outside_);
    for (const BoundSocket& socket : sockets) {
      const std::string named = fmt::format("{} at {}:{}", one.command.front(), socket.address, socket.port);
      EXPECT_TRUE(socket.isOfThisComputer()) << named;
      // a refusal may be lost on its way
      EXPECT_TRUE(becomesTrue([&] { return isRefused(socket, kBox); })) << named;
    }
  }
}

/// Who tries, from outside, and finds who takes commands of that network, finds nobody else.
TEST_F(ThisComputer, IsNotDiscoveredFromAnotherOneNorThroughAnotherInterface) {
  const Program closed(ros("closed", {}));
  const Program arm({HAPTIC_CRTK_BRIDGE_PROGRAM, "--arm", "arm", "--peer", "127.0.0.1:47800"});
  const Program behind(ros("behind", {"--interface", "behind0", "--network-may-command"}));
  const Program open(ros("open", {"--interface", "box0", "--network-may-command"}));
  for (const Program* const program : {&closed, &arm, &behind, &open})
    ASSERT_TRUE(becomesTrue([&] { return socketsOf(*program).size() >= 4; })) << program->errors();
  enter(outside_);
  const RosListener network(0,
                            fmt::format("<CycloneDDS><Domain><General><Interfaces><NetworkInterface "
                                        "name=\"outside0\"/></Interfaces></General><Discovery>"
                                        "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32"
                                        "</MaxAutoParticipantIndex><Peers><Peer Address=\"{}\"/>"
                                        "<Peer Address=\"{}\"/></Peers></Discovery></Domain></CycloneDDS>",
                                        kBox, kBehind)
                                .c_str());
  for (int attempt = 0; attempt < 3; ++attempt) {
    RosTalker intruder(0);
    for (const char* const topic : {"rt/open/servo_cf", "rt/closed/servo_cf", "rt/behind/servo_cf"})
      intruder.advertise(topic, geometry_msgs_msg_dds__WrenchStamped__desc);
    intruder.advertise("rt/arm/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc);
    ASSERT_TRUE(becomesTrue([&] { return intruder.isMatched("rt/open/servo_cf"); })) << open.errors();
    for (const char* const topic : {"rt/closed/servo_cf", "rt/behind/servo_cf", "rt/arm/measured_cp"})
      EXPECT_FALSE(intruder.isMatched(topic)) << topic;
  }
}

/// A message of RTPS with one sample, as the writer would send it.
std::string forged(const dds_guid_t& writer, std::uint32_t number, const std::string& sample) {
  const auto words = [](auto... numbers) {
    std::string bytes;
    (bytes.append(reinterpret_cast<const char*>(&numbers), sizeof numbers), ...);
    return bytes;
  };
  const std::string guid(reinterpret_cast<const char*>(writer.v), sizeof writer.v);
  const std::int64_t now_ns = rt::realtimeNow_ns();
  const auto seconds = static_cast<std::int32_t>(now_ns / rt::kNsPerSecond);
  const auto fraction =
      static_cast<std::uint32_t>(4.294967296 * static_cast<double>(now_ns % rt::kNsPerSecond));
  constexpr std::uint16_t kTime = 0x0109;  // each with the flag of little-endian numbers
  constexpr std::uint16_t kData = 0x0515;
  return "RTPS" + words(std::uint32_t{0x10010102}) + guid.substr(0, 12) +
         words(kTime, std::uint16_t{8}, seconds, fraction, kData,
               static_cast<std::uint16_t>(20 + sample.size()), std::uint16_t{0}, std::uint16_t{16},
               std::uint32_t{0}) +
         guid.substr(12) + words(std::int32_t{0}, number) + sample;
}

TEST_F(ThisComputer, TakesNoForceThatAnotherOneSendsInTheNameOfAProgramHere) {
  Daemon daemon(
      home_,
      "safety: {handle_timeout_s: 1, depth_timeout_s: 5, overrun_burst: 65, max_external_force_n: 1}\n"
      "camera: {driver: synthetic}\nsynthetic: {scene: plane, noise: off, distance_m: 2}\n"
      "simulated_handle: {start_z_m: -1, travel_m: 0.02, stroke_m: 0}\n"
      "control: {engage_at_start: true}\n");
  ASSERT_TRUE(daemon.answers());
  const Program bridge(ros("box", {}));
  // and another program, which has the computer take what comes to that group over the cable
  const Program open(ros("open", {"--interface", "box0", "--network-may-command"}));
  ASSERT_TRUE(becomesTrue([&] { return socketsOf(open).size() >= 4; })) << open.errors();
  const RosListener here(0);
  RosTalker talker(0);
  // of a reliable one none is taken before the one that follows the last
  talker.advertise("rt/box/servo_cf", geometry_msgs_msg_dds__WrenchStamped__desc, /*reliable=*/false);
  ASSERT_TRUE(becomesTrue([&] { return talker.isMatched("rt/box/servo_cf"); })) << bridge.errors();
  auto client = *tools::VarlinkClient::connect(home_.statusSocket());
  const auto external = [&] {
    const auto reply =
        client.call("io.hapticd.Status.GetStatus", nlohmann::json::object(), std::chrono::seconds(10));
    return reply ? vectorOf((*reply)["status"]["tick"]["externalForceNInWorld"]) : rt::Vec3{};
  };
  const std::vector<BoundSocket> sockets = socketsOf(bridge);
  std::uint32_t number = 1'000'000;
  const auto forge = [&](const char* computer) {
    std::string sample;
    trace::ros::encodeWrench({0, "box/world"}, {0, 0, 0.5}, {}, sample);
    ++number;
    for (const BoundSocket& socket : sockets)
      (void)sent(socket, computer, forged(talker.guidOf("rt/box/servo_cf"), number, sample));
  };
  std::string frame = "box/world";
  int taken = 0;  // of the talker's
  ASSERT_TRUE(becomesTrue([&] {
    const rt::Vec3 force_n = external();  // by what was sent the last time
    EXPECT_EQ(force_n.z, 0) << "of the forged one";
    if (force_n.x > 0) ++taken;
    enter(outside_);
    for (const char* const computer : {kBox, "239.255.0.1"}) forge(computer);
    enter(box_);
    const geometry_msgs_msg_dds__WrenchStamped_ real{{{0, 0}, frame.data()}, {{0.25, 0, 0}, {}}};
    talker.publish("rt/box/servo_cf", &real);
    return taken >= 20 || HasFailure();
  })) << bridge.errors();
  // and it is one that is taken where it comes from this computer
  EXPECT_TRUE(becomesTrue([&] {
    const bool acts = external().z > 0;
    forge("127.0.0.1");
    return acts;
  })) << bridge.errors();
}

}  // namespace
}  // namespace hapticd::test
