// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_packet.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::drivers {
namespace {

std::string text(const FalconFrame& frame) {
  return {frame.begin(), frame.end()};
}

std::optional<FalconReply> parsed(std::string_view bytes) {
  FalconFrame frame{};
  EXPECT_EQ(bytes.size(), frame.size());
  std::copy(bytes.begin(), bytes.end(), frame.begin());
  return replyIn(frame);
}

std::vector<FalconReply> repliesIn(FalconReplyStream& stream, std::string_view bytes) {
  std::vector<FalconReply> replies;
  for (const char byte : bytes) {
    if (const auto reply = stream.add(static_cast<std::uint8_t>(byte))) replies.push_back(*reply);
  }
  return replies;
}

TEST(FalconPacket, OrdersHaveTheNibblesOfEachMotorTheLeastFirst) {
  EXPECT_EQ(text(frameOf({})), "<AAAAAAAAAAAAAA>");
  // -1447 = 0xFA59; 4095 = 0x0FFF; 1 = 0x0001
  EXPECT_EQ(text(frameOf({{-1447, 4095, 1}, FalconLed::off, false})), "<JFKPPPPABAAAAA>");
}

TEST(FalconPacket, NoMotorGetsMoreThanItsLimit) {
  // beyond 16 bits the sign would change: 0x0FFF, 0xF001
  EXPECT_EQ(text(frameOf({{40000, -40000, 0}, FalconLed::off, false})), "<PPPABAAPAAAAAA>");
}

TEST(FalconPacket, RepliesNameEncodersButtonsAndHoming) {
  const auto reply = parsed(
      "<JFKPPPPHAAAI\x76"
      "A>");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->encoder_counts, (FalconCounts{-1447, 32767, -32768}));
  EXPECT_EQ(reply->buttons, 0x5);
  EXPECT_EQ(reply->homed, 0x3);
}

TEST(FalconPacket, ADamagedReplyIsNone) {
  const std::string good = "<JFKPAAAAAAAAAA>";
  ASSERT_TRUE(parsed(good));
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int byte : {0x00, 0x40, 0x51, 0xFF, int{'<'}, int{'>'}}) {
      std::string damaged = good;
      damaged[i] = static_cast<char>(byte);
      if (damaged == good || i == 13 || i == 14) continue;
      EXPECT_FALSE(parsed(damaged)) << i << " " << byte;
    }
  }
}

TEST(FalconReplyStream, FindsRepliesBetweenNoise) {
  FalconReplyStream stream;
  const std::string reply = "<JFKPAAAAAAAAAA>";
  EXPECT_EQ(repliesIn(stream, reply + reply).size(), 2U);
  EXPECT_EQ(stream.damaged(), 0U);
  EXPECT_EQ(repliesIn(stream, "noise" + reply + "\x01>>AAAA" + reply).size(), 2U);
  EXPECT_EQ(stream.damaged(), 2U);
}

TEST(FalconReplyStream, LosesOnlyTheBrokenReplyWhereverItBreaks) {
  const std::string broken = "<BBBBBBBBBBBBAA>";
  const std::string whole = "<JFKPAAAAAAAAAA>";
  for (std::size_t length = 1; length < broken.size(); ++length) {
    FalconReplyStream stream;
    const auto replies = repliesIn(stream, broken.substr(0, length) + whole + whole);
    // 13 to 15 bytes may continue with the next '<', but then end wrongly
    ASSERT_EQ(replies.size(), 2U) << length;
    EXPECT_EQ(replies[0].encoder_counts, (FalconCounts{-1447, 0, 0})) << length;
    EXPECT_EQ(stream.damaged(), 1U) << length;
  }
}

TEST(FalconReplyStream, DoesNotJoinHalvesAcrossAReset) {
  FalconReplyStream stream;
  const std::string reply = "<JFKPAAAAAAAAAA>";
  EXPECT_TRUE(repliesIn(stream, reply.substr(0, 9)).empty());
  stream.reset();
  EXPECT_TRUE(repliesIn(stream, reply.substr(9)).empty());
  EXPECT_EQ(repliesIn(stream, reply).size(), 1U);
}

TEST(RemoveStatusBytes, TakesTwoFromEachPacketOf64) {
  for (const std::size_t length : {0U, 1U, 2U, 3U, 18U, 63U, 64U, 65U, 66U, 67U, 128U, 200U, 512U}) {
    std::vector<std::uint8_t> transfer;
    std::vector<std::uint8_t> carried;
    for (std::size_t i = 0; i < length; ++i) {
      transfer.push_back(static_cast<std::uint8_t>(i));
      if (i % 64 >= 2) carried.push_back(static_cast<std::uint8_t>(i));
    }
    transfer.resize(removeStatusBytes(transfer));
    EXPECT_EQ(transfer, carried) << length;
  }
}

}  // namespace
}  // namespace hapticd::drivers
