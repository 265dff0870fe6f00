// SPDX-License-Identifier: Apache-2.0
// The packets of the UDP handle and their conversation, without sockets and clocks.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"
#include "drivers/handle/udp/peer_clock.h"
#include "udp_test_peer.h"

namespace hapticd::drivers::udp {
namespace {

using test::Bytes;
using test::RawState;
using Verdict = Conversation::Verdict;

constexpr std::int64_t kMs = 1'000'000;
constexpr const char* kKey = "0123456789abcdef";

std::span<const std::byte> spanOf(const Bytes& bytes) {
  return std::as_bytes(std::span(bytes));
}

std::span<const std::byte> keyOf(const std::string& key) {
  return std::as_bytes(std::span(key));
}

Bytes vectorOf(const PacketBytes& packet) {
  Bytes bytes;
  for (const std::byte byte : packet.bytes()) bytes.push_back(std::to_integer<std::uint8_t>(byte));
  return bytes;
}

RawState someState() {
  return {0x1122334455667788, 42,         5'000'000'000, 0x99AA, 7, 123'456, {0.1, -0.2, 9},
          {1, -99, 0.5},      0x80000005, 2 | 4};
}

std::optional<Refusal> refusalOf(const Bytes& bytes, const std::string& key = {}) {
  const auto packet = decodeState(spanOf(bytes), keyOf(key));
  return packet ? std::nullopt : std::optional(packet.error());
}

TEST(UdpPacket, AStateIsReadAndWrittenAsDocumented) {
  for (const std::string key : {"", kKey}) {
    const RawState raw = someState();
    const Bytes bytes = test::bytesOf(raw, key);
    const auto packet = decodeState(spanOf(bytes), keyOf(key));
    ASSERT_TRUE(packet) << textOf(packet.error());
    EXPECT_EQ(packet->header.session, raw.session);
    EXPECT_EQ(packet->header.sequence, raw.sequence);
    EXPECT_EQ(packet->header.time_ns, raw.time_ns);
    EXPECT_EQ(packet->header.echo.session, raw.echo_session);
    EXPECT_EQ(packet->header.echo.sequence, raw.echo_sequence);
    EXPECT_EQ(packet->header.echo.age_ns, raw.echo_age_ns);
    EXPECT_EQ(packet->position_m_in_handle, raw.position_m);
    EXPECT_EQ(packet->velocity_m_per_s_in_handle, raw.velocity_m_per_s);
    EXPECT_EQ(packet->buttons, raw.buttons);
    EXPECT_TRUE(packet->velocity_valid && packet->calibrated && !packet->fault);
    EXPECT_EQ(vectorOf(encode(*packet, keyOf(key))), bytes);
  }
  EXPECT_EQ(test::getAt<std::uint32_t>(test::bytesOf(someState()), 108), 0x88317B0A)
      << "the example of protocol.md";
}

RawState someStateOfVersion2() {
  RawState raw = someState();
  raw.version = 2;
  raw.measured = 1 | 2;
  raw.driven = 1 | 2 | 4;
  raw.orientation = {0.1, -0.5, 0.7, 0.5};
  raw.gripper_rad = 0.25;
  raw.latency_ns = 1'500'000;
  return raw;
}

TEST(UdpPacket, AStateOfVersion2IsReadAndWrittenAsDocumented) {
  for (const std::string key : {"", kKey}) {
    const RawState raw = someStateOfVersion2();
    const Bytes bytes = test::bytesOf(raw, key);
    EXPECT_EQ(bytes.size(), key.empty() ? 168 : 200);
    const auto packet = decodeState(spanOf(bytes), keyOf(key));
    ASSERT_TRUE(packet) << textOf(packet.error());
    EXPECT_EQ(packet->header.version, 2);
    EXPECT_EQ(packet->position_m_in_handle, raw.position_m);
    ASSERT_TRUE(packet->orientation_in_handle);
    EXPECT_NEAR(packet->orientation_in_handle->y, -0.5, 1e-12);
    EXPECT_NEAR(packet->orientation_in_handle->w, 0.5, 1e-12);
    EXPECT_EQ(packet->gripper_rad, 0.25);
    EXPECT_TRUE(packet->drives_torque && packet->drives_gripper);
    EXPECT_EQ(packet->device_latency_ns, 1'500'000);
    EXPECT_EQ(vectorOf(encode(*packet, keyOf(key))), bytes);
  }
  RawState none = someStateOfVersion2();
  none.measured = 0;
  none.driven = 1;
  none.orientation = {};
  const auto packet = decodeState(spanOf(test::bytesOf(none)), {});
  ASSERT_TRUE(packet);
  EXPECT_FALSE(packet->orientation_in_handle || packet->gripper_rad || packet->drives_torque ||
               packet->drives_gripper);
}

TEST(UdpPacket, AStateOfVersion2IsRefusedWhereItsOwnFieldsAreWrong) {
  const auto refused = [](auto change) {
    RawState raw = someStateOfVersion2();
    change(raw);
    return refusalOf(test::bytesOf(raw));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused([](RawState&) {}), std::nullopt);
  EXPECT_EQ(refused([&](RawState& raw) { raw.orientation[2] = nan; }), Refusal::not_finite);
  EXPECT_EQ(refused([](RawState& raw) { raw.orientation = {}; }), Refusal::out_of_range);
  EXPECT_EQ(refused([](RawState& raw) { raw.orientation = {0, 0, 0, 1.02}; }), Refusal::out_of_range);
  EXPECT_EQ(refused([&](RawState& raw) { raw.gripper_rad = nan; }), Refusal::not_finite);
  EXPECT_EQ(refused([](RawState& raw) { raw.gripper_rad = 8; }), Refusal::out_of_range);
  EXPECT_EQ(refused([](RawState& raw) { raw.latency_ns = 2'000'000'000; }), Refusal::out_of_range);
  EXPECT_EQ(refused([](RawState& raw) { raw.latency_ns = std::uint64_t{1} << 63; }), Refusal::out_of_range);
  Bytes short_one = test::bytesOf(someState());
  short_one[4] = 2;
  EXPECT_EQ(refusalOf(short_one), Refusal::wrong_size);
}

TEST(UdpPacket, TorqueAndGripperForceTravelInVersion2Only) {
  CommandPacket command;
  command.header = {3, 4, 5, {6, 7, 8}};
  command.active = true;
  command.torque_n_m_in_handle = {0.1, -0.2, 0.3};
  command.gripper_force_n = -2;
  Bytes bytes = vectorOf(encode(command, {}));
  ASSERT_EQ(bytes.size(), 168);
  EXPECT_EQ(test::getAt<double>(bytes, 120), -0.2);
  EXPECT_EQ(test::getAt<double>(bytes, 136), -2);
  auto read = decodeCommand(spanOf(bytes), {});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->torque_n_m_in_handle, command.torque_n_m_in_handle);
  EXPECT_EQ(read->gripper_force_n, -2);
  test::putAt(bytes, 112, 101.0);
  EXPECT_EQ(decodeCommand(spanOf(test::sealedAgain(bytes)), {}).error(), Refusal::out_of_range);
  command.header.version = 1;
  read = decodeCommand(encode(command, {}).bytes(), {});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->torque_n_m_in_handle, rt::Vec3{});
  EXPECT_EQ(read->gripper_force_n, 0);
}

TEST(UdpPacket, ACommandIsReadAndWrittenAsDocumented) {
  CommandPacket command;
  command.header = {3, 4, 5, {6, 7, 8}, 1};
  command.force_n_in_handle = {1, -2, 3.5};
  command.active = true;
  command.tick = 123456;
  command.tick_ns = 5'000'000'001;
  for (const std::string key : {"", kKey}) {
    const PacketBytes packet = encode(command, keyOf(key));
    const Bytes bytes = vectorOf(packet);
    EXPECT_EQ(bytes, test::sealedAgain(bytes, key));
    const test::RawCommand raw = test::commandIn(bytes);
    EXPECT_EQ(bytes[5], 2) << "kind";
    EXPECT_EQ(raw.session, 3U);
    EXPECT_EQ(raw.sequence, 4U);
    EXPECT_EQ(raw.echo_session, 6U);
    EXPECT_EQ(raw.echo_sequence, 7U);
    EXPECT_EQ(raw.force_n, command.force_n_in_handle);
    EXPECT_EQ(raw.mode, 1U);
    EXPECT_EQ(test::getAt<std::uint64_t>(bytes, 80), 123456U);
    EXPECT_EQ(test::getAt<std::int64_t>(bytes, 88), 5'000'000'001);
    const auto read = decodeCommand(packet.bytes(), keyOf(key));
    ASSERT_TRUE(read) << textOf(read.error());
    EXPECT_EQ(read->force_n_in_handle, command.force_n_in_handle);
    EXPECT_TRUE(read->active);
    EXPECT_EQ(read->tick, 123456U);
    EXPECT_EQ(read->tick_ns, 5'000'000'001);
    EXPECT_EQ(refusalOf(bytes, key), Refusal::other_kind);
  }
}

TEST(UdpPacket, DampingAtTheDeviceIsOfferedAndAcceptedInFieldsThatOlderVersionsIgnore) {
  CommandPacket command;
  command.header = {3, 4, 5, {6, 7, 8}};
  command.may_damp = true;
  command.contact_damping_n_s_per_m = 6.5;
  Bytes bytes = vectorOf(encode(command, {}));
  EXPECT_EQ(test::getAt<std::uint32_t>(bytes, 96), 1U);
  EXPECT_EQ(test::getAt<std::uint32_t>(bytes, 100), 0x40D00000U) << "6.5 as binary32";
  const auto read = [](const Bytes& of) { return decodeCommand(std::as_bytes(std::span(of)), {}); };
  ASSERT_TRUE(read(bytes));
  EXPECT_TRUE(read(bytes)->may_damp);
  EXPECT_EQ(read(bytes)->contact_damping_n_s_per_m, 6.5);
  const auto withDamping = [&](float damping) {
    test::putAt(bytes, 100, std::bit_cast<std::uint32_t>(damping));
    return read(test::sealedAgain(bytes));
  };
  EXPECT_EQ(withDamping(-1).error(), Refusal::out_of_range);
  EXPECT_EQ(withDamping(1001).error(), Refusal::out_of_range);
  EXPECT_EQ(withDamping(std::numeric_limits<float>::quiet_NaN()).error(), Refusal::not_finite);

  // What a hapticd from before the offer sends there, and the reply of a bridge that damps.
  command.may_damp = false;
  EXPECT_FALSE(read(vectorOf(encode(command, {})))->may_damp);
  StatePacket state;
  state.header = {3, 4, 5, {6, 7, 8}};
  EXPECT_EQ(test::getAt<std::uint16_t>(vectorOf(encode(state, {})), 6), 0U);
  state.damps = true;
  const Bytes damping = vectorOf(encode(state, {}));
  EXPECT_EQ(test::getAt<std::uint16_t>(damping, 6), 16U);
  EXPECT_TRUE(decodeState(std::as_bytes(std::span(damping)), {})->damps);
}

TEST(UdpPacket, EachRefusalHasItsReason) {
  const Bytes good = test::bytesOf(someState());
  const auto changed = [&](std::size_t at, auto number) {
    Bytes bytes = good;
    test::putAt(bytes, at, number);
    return test::sealedAgain(bytes);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  constexpr std::uint64_t kHuge = std::uint64_t{1} << 63;
  EXPECT_EQ(refusalOf(good), std::nullopt);
  EXPECT_EQ(refusalOf({}), Refusal::wrong_size);
  EXPECT_EQ(refusalOf(Bytes(good.begin(), good.end() - 1)), Refusal::wrong_size);
  EXPECT_EQ(refusalOf(Bytes(145)), Refusal::wrong_size);
  EXPECT_EQ(refusalOf(changed(0, std::uint8_t{'h'})), Refusal::not_this_protocol);
  EXPECT_EQ(refusalOf(changed(4, std::uint8_t{0})), Refusal::other_version);
  EXPECT_EQ(refusalOf(changed(4, std::uint8_t{3})), Refusal::other_version);
  EXPECT_EQ(refusalOf(changed(5, std::uint8_t{2})), Refusal::other_kind);
  EXPECT_EQ(refusalOf(changed(5, std::uint8_t{0})), Refusal::other_kind);
  EXPECT_EQ(refusalOf(changed(6, std::uint16_t{32})), Refusal::unknown_flags);
  EXPECT_EQ(refusalOf(changed(8, std::uint64_t{0})), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(16, std::uint64_t{0})), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(16, kHuge)), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(24, std::int64_t{-1})), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(24, std::numeric_limits<std::int64_t>::max())), Refusal::impossible_header);
  EXPECT_EQ(refusalOf(changed(32, std::uint64_t{0})), Refusal::impossible_header) << "a number of nobody";
  EXPECT_EQ(refusalOf(changed(48, kHuge)), Refusal::impossible_header);
  for (std::size_t at = 56; at < 104; at += 8) {
    EXPECT_EQ(refusalOf(changed(at, nan)), Refusal::not_finite);
    EXPECT_EQ(refusalOf(changed(at, -infinity)), Refusal::not_finite);
    EXPECT_EQ(refusalOf(changed(at, 1e308)), Refusal::out_of_range);
    EXPECT_EQ(refusalOf(changed(at, at < 80 ? 10.1 : -100.1)), Refusal::out_of_range);
  }
}

TEST(UdpPacket, EachFlippedBitIsDetected) {
  for (const Bytes& good : {test::bytesOf(someState()), test::bytesOf(someStateOfVersion2())})
    for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
      Bytes bytes = good;
      bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1U << (bit % 8)));
      EXPECT_NE(refusalOf(bytes), std::nullopt) << "bit " << bit;
    }
}

/// Two sides with a latency of 1 ms between them.
struct TwoSides {
  std::optional<Conversation> box{std::in_place, 100};
  std::optional<Conversation> bridge{std::in_place, 200};
  std::int64_t now_ns = 10'000 * kMs;

  Verdict toBox(const Header& header) {
    now_ns += kMs;
    return box->hear(header, now_ns);
  }
  Verdict toBridge(const Header& header) {
    now_ns += kMs;
    return bridge->hear(header, now_ns);
  }
  void meet() {
    const Header greeting = bridge->next(now_ns);
    ASSERT_EQ(toBox(greeting), Verdict::greeting);
    ASSERT_EQ(toBridge(box->answerTo(greeting, now_ns)), Verdict::fresh);
    ASSERT_EQ(toBox(bridge->next(now_ns)), Verdict::fresh);
  }
};

TEST(UdpConversation, TheBoxAnswersInTheVersionOfTheBridge) {
  for (const std::uint8_t version : {std::uint8_t{1}, std::uint8_t{2}}) {
    Conversation box(100);
    Conversation bridge(200, version);
    const Header greeting = bridge.next(10'000 * kMs);
    EXPECT_EQ(greeting.version, version);
    EXPECT_EQ(box.hear(greeting, 10'001 * kMs), Verdict::greeting);
    const Header answer = box.answerTo(greeting, 10'001 * kMs);
    EXPECT_EQ(answer.version, version);
    EXPECT_EQ(bridge.hear(answer, 10'002 * kMs), Verdict::fresh);
    const Header state = bridge.next(10'002 * kMs);
    EXPECT_EQ(state.version, version);
    EXPECT_EQ(box.hear(state, 10'003 * kMs), Verdict::fresh);
    EXPECT_EQ(box.next(10'003 * kMs).version, version);
  }
}

TEST(UdpConversation, BothSidesMeetInThreePacketsAndMeasureTheRoundTrip) {
  TwoSides sides;
  sides.meet();
  EXPECT_EQ(sides.box->peerSession(), 200U);
  EXPECT_EQ(sides.bridge->peerSession(), 100U);
  const Header command = sides.box->next(sides.now_ns);
  ASSERT_EQ(sides.toBridge(command), Verdict::fresh);
  sides.now_ns += 7 * kMs;  // the bridge's own time is part of the loop, not of the round trip
  ASSERT_EQ(sides.toBox(sides.bridge->next(sides.now_ns)), Verdict::fresh);
  EXPECT_EQ(sides.box->loopNs(), 9 * kMs);
  EXPECT_EQ(sides.box->link().round_trip.max_ns, 2'000'000U);
  EXPECT_EQ(sides.bridge->link().round_trip.max_ns, 2'000'000U);
}

TEST(UdpConversation, CountsLostDuplicatedAndReorderedPackets) {
  TwoSides sides;
  sides.meet();
  std::vector<Header> packets;
  for (int i = 0; i < 8; ++i) packets.push_back(sides.bridge->next(sides.now_ns));
  EXPECT_EQ(sides.toBox(packets[0]), Verdict::fresh);
  EXPECT_EQ(sides.toBox(packets[0]), Verdict::duplicated);
  EXPECT_EQ(sides.toBox(packets[3]), Verdict::fresh);
  EXPECT_EQ(sides.box->link().lost, 2U);
  EXPECT_EQ(sides.toBox(packets[1]), Verdict::reordered);
  EXPECT_EQ(sides.toBox(packets[1]), Verdict::duplicated);
  EXPECT_EQ(sides.toBox(packets[7]), Verdict::fresh);
  const LinkStatus link = sides.box->link();
  EXPECT_EQ(link.lost, 4U) << "2, 4, 5, 6";
  EXPECT_EQ(link.duplicated, 2U);
  EXPECT_EQ(link.reordered, 1U);
  EXPECT_EQ(link.rejected, 0U);
  EXPECT_EQ(link.received, 8U) << "2 of meeting, 6 here";
}

TEST(UdpConversation, APacketTooOldToBeRememberedIsNotTreatedAsNew) {
  TwoSides sides;
  sides.meet();
  std::vector<Header> packets;
  for (int i = 0; i < 70; ++i) packets.push_back(sides.bridge->next(sides.now_ns));
  ASSERT_EQ(sides.toBox(packets[69]), Verdict::fresh);
  EXPECT_EQ(sides.toBox(packets[6]), Verdict::reordered) << "63 before the newest";
  EXPECT_EQ(sides.toBox(packets[5]), Verdict::unproven) << "64 before the newest";
}

TEST(UdpConversation, RefusesPacketsOfAnEarlierStartOfItself) {
  TwoSides sides;
  sides.meet();
  const Header old = sides.bridge->next(sides.now_ns);
  sides.box.emplace(101);
  EXPECT_EQ(sides.toBox(old), Verdict::unproven);
  EXPECT_EQ(sides.box->peerSession(), 0U);
  EXPECT_EQ(sides.toBridge(sides.box->answerTo(old, sides.now_ns)), Verdict::fresh);
  EXPECT_EQ(sides.toBox(sides.bridge->next(sides.now_ns)), Verdict::fresh);
}

TEST(UdpConversation, ContinuesWithARestartedPeerAndNeverReturns) {
  TwoSides sides;
  sides.meet();
  const Header recorded = sides.bridge->next(sides.now_ns);
  const Header greeting_before = {200, 1, sides.now_ns, {}};
  sides.bridge.emplace(201);
  sides.meet();
  EXPECT_EQ(sides.box->peerSession(), 201U);
  EXPECT_EQ(sides.toBox(recorded), Verdict::unproven);
  EXPECT_EQ(sides.toBox(greeting_before), Verdict::greeting);
  EXPECT_EQ(sides.box->peerSession(), 201U);
  EXPECT_EQ(sides.toBox(sides.bridge->next(sides.now_ns)), Verdict::fresh);
}

/// Exchanges packets as both programs do, and returns after how many of a side's packets both have taken over
/// a packet of the other; 0: never within 10.
int packetsUntilBothFollow(TwoSides& sides) {
  bool box_follows = false;
  bool bridge_follows = false;
  for (int packets = 1; packets <= 10; ++packets) {
    const Header state = sides.bridge->next(sides.now_ns);
    const Verdict verdict = sides.toBox(state);
    box_follows = verdict == Verdict::fresh;
    const bool unproven = verdict == Verdict::unproven || verdict == Verdict::greeting;
    const Header command =
        unproven ? sides.box->answerTo(state, sides.now_ns) : sides.box->next(sides.now_ns);
    bridge_follows = sides.toBridge(command) == Verdict::fresh;
    if (box_follows && bridge_follows) return packets;
  }
  return 0;
}

TEST(UdpConversation, GoesOnWithTheGenuinePeerAfterSomebodyWithTheKeyHasNumberedAhead) {
  constexpr std::uint64_t kFarthest = std::uint64_t{1} << 62;
  for (const std::uint64_t ahead : {std::uint64_t{200}, std::uint64_t{100'000}, kFarthest}) {
    TwoSides sides;
    sides.meet();
    Header state = sides.bridge->next(sides.now_ns);
    state.sequence = ahead;
    ASSERT_EQ(sides.toBox(state), Verdict::fresh) << "it is proven";
    Header command = sides.box->next(sides.now_ns);
    command.sequence = ahead;
    command.echo.sequence = 2;  // the newest genuine state
    ASSERT_EQ(sides.toBridge(command), Verdict::fresh);

    const int packets = packetsUntilBothFollow(sides);
    EXPECT_TRUE(packets >= 1 && packets <= 3) << packets << " after " << ahead;
    for (int i = 0; i < 100; ++i) ASSERT_EQ(packetsUntilBothFollow(sides), 1) << i << " after " << ahead;
    // the numbers that were left out may count as lost only where they can have been sent
    const std::uint64_t most_lost = ahead <= 500 ? ahead : 0;  // 5 in each of 100 ms
    EXPECT_LE(sides.box->link().lost, most_lost);
    EXPECT_LE(sides.bridge->link().lost, most_lost);
  }
}

/// Whatever a network does to packets of a peer that numbers as it should: none is taken over that is older
/// than one that was, and none twice.
TEST(UdpConversation, NeverTakesOverAnOlderPacketOfAGenuinePeer) {
  std::mt19937 random(17);
  for (int run = 0; run < 20; ++run) {
    TwoSides sides;
    sides.meet();
    const unsigned longest_ms = std::array{2U, 40U, 300U}[static_cast<std::size_t>(run % 3)];
    std::multimap<std::int64_t, Header> to_box;
    std::multimap<std::int64_t, Header> to_bridge;
    const auto push = [&](auto& network, const Header& header) {
      for (unsigned copies = random() % 8 == 0 ? static_cast<unsigned>(random() % 3) : 1; copies > 0;
           --copies)
        network.emplace(sides.now_ns + static_cast<std::int64_t>(random() % longest_ms) * kMs, header);
    };
    std::uint64_t newest_state = 0;
    std::uint64_t newest_command = 0;
    int taken = 0;
    for (int step = 0; step < 5000; ++step) {
      sides.now_ns += kMs;
      push(to_box, sides.bridge->next(sides.now_ns));
      for (; !to_box.empty() && to_box.begin()->first <= sides.now_ns; to_box.erase(to_box.begin())) {
        const Header state = to_box.begin()->second;
        const Verdict verdict = sides.box->hear(state, sides.now_ns);
        if (verdict == Verdict::fresh) {
          ASSERT_GT(state.sequence, newest_state);
          newest_state = state.sequence;
          ++taken;
        }
        push(to_bridge, verdict == Verdict::fresh ? sides.box->next(sides.now_ns)
                                                  : sides.box->answerTo(state, sides.now_ns));
      }
      for (; !to_bridge.empty() && to_bridge.begin()->first <= sides.now_ns;
           to_bridge.erase(to_bridge.begin())) {
        const Header command = to_bridge.begin()->second;
        if (sides.bridge->hear(command, sides.now_ns) != Verdict::fresh) continue;
        ASSERT_GT(command.sequence, newest_command);
        newest_command = command.sequence;
      }
    }
    EXPECT_TRUE(taken > 100 || longest_ms > 100) << "an echo is valid for 100 ms";
  }
}

TEST(UdpConversation, RefusesDelayedPacketsAndRecoversByAReply) {
  TwoSides sides;
  sides.meet();
  const Header in_time = sides.bridge->next(sides.now_ns);
  const Header late = sides.bridge->next(sides.now_ns);
  const std::int64_t echoed_ns = sides.now_ns - 2 * kMs;  // when the box sent the packet that both echo
  EXPECT_EQ(sides.box->hear(in_time, echoed_ns + kFreshNs), Verdict::fresh);
  EXPECT_EQ(sides.box->hear(late, echoed_ns + kFreshNs + 1), Verdict::unproven);
  sides.now_ns = echoed_ns + kFreshNs + 1;
  EXPECT_EQ(sides.toBridge(sides.box->answerTo(late, sides.now_ns)), Verdict::fresh);
  EXPECT_EQ(sides.toBox(sides.bridge->next(sides.now_ns)), Verdict::fresh);
  EXPECT_EQ(sides.box->link().lost, 0U) << "the late one was refused, not lost";
}

TEST(UdpConversation, RejectsEchoesOfUnsentOrTooOldPackets) {
  TwoSides sides;
  sides.meet();
  Header header = sides.bridge->next(sides.now_ns);
  header.echo.sequence += 1;
  EXPECT_EQ(sides.toBox(header), Verdict::unproven);
  header = sides.bridge->next(sides.now_ns);
  header.echo.age_ns = 50 * kMs;
  EXPECT_EQ(sides.toBox(header), Verdict::unproven);
}

TEST(UdpConversation, SessionsAreNeverZeroAndDifferEachTime) {
  std::set<std::uint64_t> sessions{0};
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(sessions.insert(randomSession()).second);
}

TEST(DelayEstimate, IsTheNinetyFifthPercentileOfTheNewest) {
  DelayEstimate delay;
  EXPECT_EQ(delay.ninetyFifthPercentileNs(), 0);
  for (int i = 0; i < 1000; ++i) delay.add(1'000'000);
  for (int i = 1; i <= 256; ++i) delay.add(i);
  EXPECT_EQ(delay.ninetyFifthPercentileNs(), 243);  // rank floor(255 * 0.95) = 242 of 0..255
}

TEST(PeerClock, KeepsTheSpacingThroughJitterAndShowsLatePacketsAsOld) {
  PeerClock clock;
  constexpr std::int64_t kOffset = 777 * kMs;
  EXPECT_EQ(clock.ourTimeNs(1000 * kMs, 1000 * kMs + kOffset), 1000 * kMs + kOffset);
  EXPECT_EQ(clock.ourTimeNs(1001 * kMs, 1004 * kMs + kOffset), 1001 * kMs + kOffset);
  EXPECT_EQ(clock.ourTimeNs(1002 * kMs, 1002 * kMs + kOffset - 10), 1002 * kMs + kOffset - 10);
  // clocks that drift apart: 100 ppm, one packet every 10 ms; never more behind than 2 s of drift
  PeerClock drifting;
  for (std::int64_t ms = 10; ms < 60'000; ms += 10) {
    const std::int64_t arrived_ns = ms * kMs + ms * 100 + kOffset;
    const std::int64_t ours_ns = drifting.ourTimeNs(ms * kMs, arrived_ns);
    EXPECT_LE(ours_ns, arrived_ns);
    EXPECT_LE(arrived_ns - ours_ns, 200'000 + 1000);
  }
}

}  // namespace
}  // namespace hapticd::drivers::udp
