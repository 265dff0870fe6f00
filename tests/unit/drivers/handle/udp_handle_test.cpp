// SPDX-License-Identifier: Apache-2.0
// The UDP handle with a peer that implements protocol.md independently, over real sockets.

#include "drivers/handle/udp/udp_handle.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "drivers/driver_table.h"
#include "drivers/handle/udp/udp_settings.h"
#include "rt/base/clock.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/drivers/frame_collector.h"
#include "udp_test_peer.h"

namespace hapticd::drivers {
namespace {

using test::Bytes;
using test::RawCommand;
using test::RawState;

constexpr std::uint16_t kPort = 47800;
constexpr std::uint16_t kPeerPort = 47801;
constexpr const char* kKey = "a key of 24 bytes, about";

/// Of a hand at rest: so slow that no dwell at one position contradicts it (VelocityCheck).
constexpr rt::Vec3 kVelocity_m_per_s{0.001, 0.002, 0.003};

/// A bridge that echoes the last packet received.
class Peer {
 public:
  explicit Peer(std::uint64_t session, std::string key = {})
      : socket_(test::ownLoopback(2), kPeerPort), key_(std::move(key)) {
    state_.session = session;
    state_.position_m = {0.1, 0.2, 0.3};
    state_.velocity_m_per_s = kVelocity_m_per_s;
    state_.buttons = 5;
  }

  RawState& state() { return state_; }
  const test::TestSocket& socket() const { return socket_; }
  const std::vector<Bytes>& sent() const { return sent_; }

  /// Simulates a restart of the bridge.
  void restart(std::uint64_t session) {
    const RawState before = state_;
    state_ = {};
    state_.session = session;
    state_.position_m = before.position_m;
    heard_ns_ = 0;
  }

  /// Returns the next state without sending it.
  Bytes next() {
    ++state_.sequence;
    state_.time_ns = rt::monotonicNow_ns();
    state_.echo_age_ns = heard_ns_ == 0 ? 0 : static_cast<std::uint64_t>(state_.time_ns - heard_ns_);
    return test::bytesOf(state_, key_);
  }
  void send(const Bytes& bytes) {
    socket_.send(bytes, test::ownLoopback(1), kPort);
    sent_.push_back(bytes);
  }
  void send() { send(next()); }

  /// Returns the next command that arrives within `wait_ms`; it is echoed next if it is for this session.
  std::optional<RawCommand> receive(int wait_ms) {
    const auto bytes = socket_.receive(wait_ms);
    if (!bytes) return std::nullopt;
    EXPECT_EQ(*bytes, test::sealedAgain(*bytes, key_));
    const RawCommand command = test::commandIn(*bytes);
    if (command.echo_session != state_.session) return command;
    state_.echo_session = command.session;
    state_.echo_sequence = command.sequence;
    heard_ns_ = rt::monotonicNow_ns();
    return command;
  }

 private:
  test::TestSocket socket_;
  std::string key_;
  RawState state_;
  std::int64_t heard_ns_ = 0;
  std::vector<Bytes> sent_;
};

config::HandleSettings settings(const std::string& key_file = {}) {
  config::HandleSettings settings;
  settings.driver = "udp";
  settings.of<UdpHandleSettings>().address = test::ownLoopback(1);
  settings.of<UdpHandleSettings>().port = kPort;
  settings.of<UdpHandleSettings>().peer = test::ownLoopback(2);
  settings.of<UdpHandleSettings>().key_file = key_file;
  return settings;
}

/// The handle, its peer and a force loop that ticks with each exchange.
struct Rig {
  explicit Rig(const config::HandleSettings& handle_settings = settings(), const std::string& key = {})
      : handle(handle_settings, {}), peer(200, key) {}
  ~Rig() { handle.stop(); }

  /// Sends one state and returns the reply; the force loop ticks before.
  std::optional<RawCommand> exchange() {
    if (force_loop_ticks) command();
    peer.send();
    const auto command = peer.receive(20);
    while (peer.receive(0)) {
    }
    return command;
  }
  /// Commands a force like a tick of the force loop that has read the newest state.
  void command() {
    channels->state.refresh();
    channels->command.write({force_n, ++tick, channels->state.front().session, rt::monotonicNow_ns()});
  }
  bool becomesPresent() {
    return test::eventually([&] {
      exchange();
      return handle.status().state == HandlePresence::present;
    });
  }
  /// Waits until this many packets have arrived, whether accepted or not.
  bool hasReceived(std::uint64_t count) {
    return test::eventually([&] { return link().received >= count; });
  }
  LinkStatus link() const { return handle.status().link.value_or(LinkStatus{}); }
  bool detailContains(const std::string& part) const {
    const HandleStatus status = handle.status();
    return (status.detail + status.advice).find(part) != std::string::npos;
  }

  std::unique_ptr<HandleChannels> channels = std::make_unique<HandleChannels>();
  UdpHandle handle;
  Peer peer;
  rt::Vec3 force_n{1, 2, 3};
  std::uint64_t tick = 0;
  bool force_loop_ticks = true;
};

TEST(UdpHandle, TransformsMeasurementsAndForcesByThePose) {
  config::HandleSettings turned = settings();
  turned.setPose({{10, 20, 30}, 0, 0, std::numbers::pi / 2});
  Rig rig(turned);
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  EXPECT_EQ(rig.handle.status().state, HandlePresence::absent);
  ASSERT_TRUE(rig.becomesPresent()) << rig.handle.status().detail;

  std::optional<RawCommand> command;
  ASSERT_TRUE(test::eventually([&] {
    command = rig.exchange();
    return command && command->mode == 1;
  }));
  constexpr double kRounding = 1e-12;  // of a rotation in double precision
  EXPECT_NEAR(command->force_n.x, 2, kRounding);
  EXPECT_NEAR(command->force_n.y, -1, kRounding);
  EXPECT_NEAR(command->force_n.z, 3, kRounding);

  rig.channels->state.refresh();
  const rt::HandleState& state = rig.channels->state.front();
  EXPECT_NEAR(state.position_m_in_world.x, 10 - 0.2, kRounding);
  EXPECT_NEAR(state.position_m_in_world.y, 20 + 0.1, kRounding);
  EXPECT_NEAR(state.position_m_in_world.z, 30 + 0.3, kRounding);
  EXPECT_EQ(state.velocity_claim, rt::VelocityClaim::consistent);
  EXPECT_EQ(state.velocity_m_per_s_in_world, rt::Vec3{}) << "it stands still, whatever it claims";
  EXPECT_EQ(state.buttons, 5U);
  EXPECT_EQ(state.session, 1U);
  EXPECT_EQ(state.condition, rt::HandleCondition::ready);
  EXPECT_LE(state.time_ns, rt::monotonicNow_ns());
}

TEST(UdpHandle, ReportsTheWholeRoundTripOfAForceAsItsDelay) {
  Rig rig;
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(rig.becomesPresent());
  constexpr std::chrono::milliseconds kDwell{10};  // of each command at the peer: a part of the loop
  for (int i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(kDwell);
    rig.exchange();
  }
  rig.channels->state.refresh();
  EXPECT_GE(rig.channels->state.front().delay_s, 0.010);
  EXPECT_GT(rig.link().round_trip.p50_ns, 0U);
}

TEST(UdpHandle, PacketsFromOthersAreCountedAndNeverAnswered) {
  Rig rig;
  const test::TestSocket stranger(test::ownLoopback(3), kPeerPort);
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  RawState greeting;
  greeting.session = greeting.sequence = 1;
  stranger.send(test::bytesOf(greeting), test::ownLoopback(1), kPort);
  ASSERT_TRUE(rig.hasReceived(1));
  EXPECT_EQ(rig.link().rejected, 1U);
  ASSERT_TRUE(rig.detailContains("from " + test::ownLoopback(3))) << rig.handle.status().detail;
  EXPECT_EQ(rig.link().sent, 0U);
  ASSERT_TRUE(rig.becomesPresent());
  EXPECT_FALSE(stranger.receive(0));
}

TEST(UdpHandle, ReplayedPacketsAreRejected) {
  Rig rig;
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(rig.becomesPresent());
  for (int i = 0; i < 10; ++i) rig.exchange();
  const std::vector<Bytes> recorded = rig.peer.sent();
  ASSERT_TRUE(rig.hasReceived(recorded.size()));
  const LinkStatus before = rig.link();
  const std::uint64_t taken = rig.handle.status().measurements;
  for (const Bytes& bytes : recorded) rig.peer.send(bytes);
  ASSERT_TRUE(rig.hasReceived(before.received + recorded.size()));
  EXPECT_EQ(rig.handle.status().measurements, taken);
  EXPECT_GE(rig.link().duplicated, before.duplicated + 10);

  rig.handle.stop();
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  for (const Bytes& bytes : recorded) rig.peer.send(bytes);
  ASSERT_TRUE(rig.hasReceived(recorded.size()));
  EXPECT_EQ(rig.handle.status().measurements, 0U);
  EXPECT_EQ(rig.handle.status().state, HandlePresence::absent);
  rig.channels->state.refresh();
  EXPECT_FALSE(rig.channels->state.refresh());
}

TEST(UdpHandle, OnlyTheSameKeyIsAccepted) {
  const test::TemporaryFolder folder;
  const std::string file = folder.write("key", kKey);
  ASSERT_EQ(::chmod(file.c_str(), 0640), 0);
  struct Case {
    std::string our_file;
    std::string their_key;
    std::string said;
  };
  for (const auto& [our_file, their_key, said] : {Case{file, kKey, ""}, Case{file, "", "not authenticated"},
                                                  Case{file, "another key, of 27 bytes...", "another key"},
                                                  Case{"", kKey, "no key is configured here"}}) {
    Rig rig(settings(our_file), their_key);
    ASSERT_TRUE(rig.handle.start(*rig.channels));
    if (said.empty()) {
      EXPECT_TRUE(rig.becomesPresent());
      continue;
    }
    EXPECT_TRUE(test::eventually([&] {
      rig.exchange();
      return rig.detailContains(said);
    })) << rig.handle.status().detail;
    EXPECT_EQ(rig.handle.status().state, HandlePresence::absent);
    EXPECT_EQ(rig.link().sent, 0U);
  }
}

TEST(UdpHandle, IsLostWithoutStatesAndReconnectsAsANewSessionWithoutOldForces) {
  Rig rig;
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(rig.becomesPresent());
  ASSERT_TRUE(test::eventually([&] { return rig.handle.status().state == HandlePresence::lost; }));
  EXPECT_TRUE(rig.detailContains("100 ms")) << rig.handle.status().detail;
  while (rig.peer.receive(0)) {
  }
  rig.command();
  rig.force_loop_ticks = false;
  EXPECT_TRUE(test::eventually([&] {
    const auto command = rig.exchange();
    EXPECT_TRUE(!command || command->mode == 0) << "the force loop does not know of the new session yet";
    return rig.handle.status().state == HandlePresence::present;
  }));
  rig.channels->state.refresh();
  EXPECT_GE(rig.channels->state.front().session, 2U);
  rig.force_loop_ticks = true;
  EXPECT_TRUE(test::eventually([&] {
    const auto command = rig.exchange();
    return command && command->mode == 1;
  }));
}

TEST(UdpHandle, APeerThatStartsAgainIsANewSessionAtOnce) {
  Rig rig;
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(rig.becomesPresent());
  rig.channels->state.refresh();
  const std::uint64_t session = rig.channels->state.front().session;
  rig.peer.restart(201);
  rig.peer.state().position_m.x = -0.5;
  EXPECT_TRUE(test::eventually([&] {
    rig.exchange();
    return rig.channels->state.refresh() && rig.channels->state.front().position_m_in_world.x == -0.5;
  }));
  EXPECT_GT(rig.channels->state.front().session, session);
}

TEST(UdpHandle, ExertsNothingWhenTheForceLoopHangs) {
  Rig rig;
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(rig.becomesPresent());
  const auto modeBecomes = [&](std::uint32_t mode) {
    return test::eventually([&] {
      const auto command = rig.exchange();
      EXPECT_TRUE(!command || command->mode == 1 || command->force_n == rt::Vec3{});
      return command && command->mode == mode;
    });
  };
  ASSERT_TRUE(modeBecomes(1));
  rig.force_loop_ticks = false;
  EXPECT_TRUE(modeBecomes(0));
  rig.force_loop_ticks = true;
  EXPECT_TRUE(modeBecomes(1));
}

TEST(UdpHandle, SendsCommandsUnpromptedAndSaysGoodbye) {
  Rig rig;
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(rig.becomesPresent());
  EXPECT_TRUE(test::eventually([&] {
    rig.exchange();
    return rig.peer.receive(20) && rig.peer.receive(20);  // more than the reply, from a silent peer
  }));
  ASSERT_TRUE(test::eventually([&] {
    const auto command = rig.exchange();
    return command && command->mode == 1;
  }));
  rig.handle.stop();
  std::vector<RawCommand> left;
  while (const auto command = rig.peer.receive(0)) left.push_back(*command);
  ASSERT_GE(left.size(), 2U);
  EXPECT_TRUE(std::all_of(left.end() - 2, left.end(), [](const RawCommand& command) {
    return command.mode == 0 && command.force_n == rt::Vec3{};
  }));
  EXPECT_EQ(rig.handle.status().state, HandlePresence::absent);
}

TEST(UdpHandle, ADeviceThatIsNotReadyExertsNoForce) {
  Rig rig;
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(rig.becomesPresent());
  const auto reaches = [&](HandlePresence presence) {
    return test::eventually([&] {
      rig.exchange();
      return rig.handle.status().state == presence;
    });
  };
  constexpr std::uint16_t kCalibrated = 4;
  constexpr std::uint16_t kFault = 8;
  rig.peer.state().flags = 0;
  ASSERT_TRUE(reaches(HandlePresence::calibrating));
  rig.channels->state.refresh();
  EXPECT_EQ(rig.channels->state.front().condition, rt::HandleCondition::not_calibrated);
  EXPECT_EQ(rig.exchange().value_or(RawCommand{}).mode, 0U);

  rig.peer.state().flags = kCalibrated | kFault;
  ASSERT_TRUE(test::eventually([&] {
    rig.exchange();
    return rig.detailContains("fault");
  }));
  EXPECT_EQ(rig.handle.status().state, HandlePresence::lost);
  EXPECT_EQ(rig.exchange().value_or(RawCommand{}).mode, 0U);
  rig.channels->state.refresh();
  const std::uint64_t session = rig.channels->state.front().session;
  rig.peer.state().flags = kCalibrated;
  ASSERT_TRUE(reaches(HandlePresence::present));
  rig.channels->state.refresh();
  EXPECT_GT(rig.channels->state.front().session, session);
}

TEST(UdpHandle, WaitsForAPortThatIsTaken) {
  Rig rig;
  auto other = std::make_unique<test::TestSocket>(test::ownLoopback(1), kPort);
  ASSERT_TRUE(rig.handle.start(*rig.channels));
  ASSERT_TRUE(test::eventually([&] { return rig.detailContains("Address already in use"); }));
  EXPECT_EQ(rig.handle.status().state, HandlePresence::absent);
  other.reset();
  EXPECT_TRUE(rig.becomesPresent()) << rig.handle.status().detail;
}

TEST(UdpHandle, DoesNotStartWithInvalidSettings) {
  const test::TemporaryFolder folder;
  const auto channels = std::make_unique<HandleChannels>();
  const auto refusal = [&](const config::HandleSettings& broken) {
    UdpHandle handle(broken, {});
    const auto started = handle.start(*channels);
    return started ? std::string() : started.error().text();
  };
  config::HandleSettings broken = settings();
  broken.of<UdpHandleSettings>().peer = "device.example";
  EXPECT_NE(refusal(broken).find("udp_handle.peer: \"device.example\" is not an IPv4 address"),
            std::string::npos);
  broken = settings();
  broken.of<UdpHandleSettings>().address = "127.0.0.256";
  EXPECT_NE(refusal(broken).find("udp_handle.address"), std::string::npos);

  const std::string key = folder.write("key", kKey);
  const std::string short_key = folder.write("short", "fifteen bytes..");
  ASSERT_EQ(::chmod(short_key.c_str(), 0600), 0);
  ASSERT_EQ(::chmod(key.c_str(), 0604), 0);
  EXPECT_NE(refusal(settings(key)).find("others may read or write it"), std::string::npos);
  EXPECT_NE(refusal(settings(short_key)).find("has 15 bytes"), std::string::npos);
  EXPECT_NE(refusal(settings(folder.path() / "none")).find("No such file"), std::string::npos);
  EXPECT_NE(refusal(settings(folder.path())).find("not a regular file"), std::string::npos);
}

TEST(UdpHandle, IsCreatedFromTheSettings) {
  EXPECT_NE(dynamic_cast<UdpHandle*>(makeHandle(settings(), {}).get()), nullptr);
}

}  // namespace
}  // namespace hapticd::drivers
