// SPDX-License-Identifier: Apache-2.0
// The conversation of the UDP handle with its bridge, without sockets and clocks.

#include "drivers/handle/udp/conversation.h"

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include "drivers/handle/udp/conversation.h"

namespace hapticd::drivers::udp {
namespace {

using Verdict = Conversation::Verdict;

constexpr std::int64_t kMs = 1'000'000;

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
