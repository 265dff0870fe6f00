// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/outbox.h"

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace hapticd::tools::view {
namespace {

constexpr std::size_t kMiB = 1024 * 1024;

MessageKey key(std::uint64_t number) {
  return static_cast<MessageKey>(number);
}

/// A message of that size whose bytes are those of all others.
Message messageOf(std::size_t bytes, const std::string& head = "") {
  static const std::vector<std::byte> content(80 * kMiB);
  return {.head = head, .body = std::span(content).first(bytes - head.size())};
}

/// What is transmitted until nothing waits.
std::vector<std::string> headsOf(Outbox& outbox) {
  std::vector<std::string> heads;
  while (const Message* message = outbox.beginTransmission()) {
    heads.push_back(message->head);
    outbox.endTransmission();
  }
  return heads;
}

TEST(Outbox, GivesQueuedMessagesFirstAndOfEachKeyTheNewestInTurn) {
  Outbox::All all;
  Outbox outbox(all);
  outbox.add(textMessage("a1"), key(1));
  outbox.add(textMessage("b1"), key(2));
  outbox.add(textMessage("q1"), MessageKey::queued);
  outbox.add(textMessage("a2, longer"), key(1));
  outbox.add(textMessage("q2"), MessageKey::queued);
  EXPECT_TRUE(outbox.waits(key(1)) && outbox.waits(key(2)) && outbox.waits(MessageKey::queued));
  EXPECT_EQ(headsOf(outbox), (std::vector<std::string>{"q1", "q2", "a2, longer", "b1"}));
  EXPECT_EQ(outbox.replaced(), 1U);
  EXPECT_EQ(outbox.dropped(), 0U);
  EXPECT_EQ(outbox.bytes(), 0U);
}

TEST(Outbox, TransmitsOneMessageAtATime) {
  Outbox::All all;
  Outbox outbox(all);
  outbox.add(textMessage("first"), key(1));
  outbox.add(textMessage("second"), key(2));
  ASSERT_NE(outbox.beginTransmission(), nullptr);
  EXPECT_EQ(outbox.beginTransmission(), nullptr);
  outbox.clear();
  EXPECT_TRUE(outbox.isTransmitting()) << "it cannot be taken back";
  EXPECT_EQ(outbox.bytes(), 5U);
  outbox.endTransmission();
  EXPECT_EQ(outbox.beginTransmission(), nullptr);
}

TEST(Outbox, ForgetsWhatIsWithdrawn) {
  Outbox::All all;
  Outbox outbox(all);
  outbox.add(textMessage("a"), key(1));
  outbox.add(textMessage("b"), key(2));
  outbox.withdraw(key(1));
  outbox.withdraw(key(3));
  EXPECT_FALSE(outbox.waits(key(1)));
  EXPECT_EQ(headsOf(outbox), std::vector<std::string>{"b"});
}

TEST(Outbox, HoldsALimitedNumberOfBytesForKeysThatAreNew) {
  Outbox::All all;
  Outbox outbox(all);
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    outbox.add(messageOf(kMiB), key(i));
    ASSERT_LE(outbox.bytes(), Outbox::kMaxKeyedBytes);
    ASSERT_TRUE(outbox.waits(key(i)));
  }
  EXPECT_EQ(outbox.dropped(), 1000 - Outbox::kMaxKeyedBytes / kMiB);
}

TEST(Outbox, LosesItsLargestMessageFirst) {
  Outbox::All all;
  Outbox outbox(all);
  outbox.add(textMessage("parameters"), key(1));
  outbox.add(messageOf(Outbox::kMaxKeyedBytes - kMiB, "cloud"), key(2));
  outbox.add(messageOf(2 * kMiB, "image"), key(3));
  EXPECT_EQ(headsOf(outbox), (std::vector<std::string>{"parameters", "image"}));
}

TEST(Outbox, TakesFromTheFullestClientWhatAllTogetherMayNotHold) {
  Outbox::All all;
  std::deque<Outbox> greedy;
  for (int i = 0; i < 7; ++i) greedy.emplace_back(all);
  for (Outbox& each : greedy) {
    for (std::uint64_t i = 1; i <= 16; ++i) each.add(messageOf(kMiB), key(i));
  }
  Outbox modest(all);
  modest.add(messageOf(2 * kMiB, "frame"), key(1));
  EXPECT_TRUE(modest.waits(key(1)));
  std::size_t bytes = modest.bytes();
  for (const Outbox& each : greedy) bytes += each.bytes();
  EXPECT_LE(bytes, Outbox::kMaxKeyedBytesOfAll);
  EXPECT_EQ(modest.dropped(), 0U);
}

TEST(Outbox, CountsWhatIsInTransmissionAndDropsWhatHasNoRoomBesideIt) {
  Outbox::All all;
  std::deque<Outbox> clients;
  for (int i = 0; i < 8; ++i) {
    Outbox& client = clients.emplace_back(all);
    client.add(messageOf(8 * kMiB), key(1));
    ASSERT_NE(client.beginTransmission(), nullptr);
  }
  clients[0].add(messageOf(1), key(1));
  EXPECT_FALSE(clients[0].waits(key(1)));
  EXPECT_EQ(clients[0].dropped(), 1U);
  clients[1].endTransmission();
  clients[0].add(messageOf(1), key(1));
  EXPECT_TRUE(clients[0].waits(key(1)));
}

/// Whatever is done, the limits hold and each message is accounted for.
TEST(Outbox, KeepsItsLimitsAndItsAccountsOverRandomUse) {
  std::mt19937 random(11);
  const auto upTo = [&](std::size_t most) { return random() % most; };
  Outbox::All all;
  std::deque<Outbox> clients;
  for (int i = 0; i < 8; ++i) clients.emplace_back(all);
  struct Account {
    std::uint64_t added = 0;
    std::uint64_t taken = 0;
    std::uint64_t withdrawn = 0;
  };
  std::vector<Account> accounts(clients.size());
  for (int step = 0; step < 50'000; ++step) {
    const std::size_t client = upTo(clients.size());
    Outbox& outbox = clients[client];
    const MessageKey chosen = key(upTo(30));  // 0: queued
    switch (upTo(8)) {
      case 0:
        if (outbox.isTransmitting()) outbox.endTransmission();
        break;
      case 1:
        if (outbox.beginTransmission() != nullptr) ++accounts[client].taken;
        break;
      case 2:
        if (chosen != MessageKey::queued && outbox.waits(chosen)) ++accounts[client].withdrawn;
        outbox.withdraw(chosen);
        break;
      default:
        outbox.add(messageOf(1 + upTo(upTo(10) == 0 ? 20 * kMiB : 100'000)), chosen);
        ++accounts[client].added;
    }
    std::size_t bytes = 0;
    for (const Outbox& each : clients) bytes += each.bytes();
    const std::size_t queues =
        clients.size() * 2 * 20 * kMiB;  // at most a large message each, and another in transmission
    ASSERT_LE(bytes, Outbox::kMaxKeyedBytesOfAll + queues);
  }
  for (std::size_t i = 0; i < clients.size(); ++i) {
    const Account& account = accounts[i];
    const std::uint64_t lost = clients[i].replaced() + clients[i].dropped();
    if (clients[i].isTransmitting()) clients[i].endTransmission();
    EXPECT_EQ(account.added, account.taken + account.withdrawn + lost + headsOf(clients[i]).size());
    EXPECT_EQ(clients[i].bytes(), 0U);
  }
}

}  // namespace
}  // namespace hapticd::tools::view
